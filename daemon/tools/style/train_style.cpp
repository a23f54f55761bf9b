#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/style/style_report.hpp"
#include "daemon/tools/style/train_style.hpp"
#include "models/fixed_products.hpp"
#include "models/style/train/train.hpp"
#include "proto/clip/format.hpp"

namespace posed::tools {
namespace {

constexpr const char* kTrainStyleFooter = R"(Examples:
  posed train style --from plain_1.bvh plain_2.bvh --to proud_1.bvh proud_2.bvh --out proud.style
  posed train style --from ann:a.bvh ann:b.bvh bob:c.bvh --to ann:d.bvh --out two.style
  posed train style --motion walk --from 02_02.amc 35_01.amc --to 08_01.amc --pose-space cmu43 \
      --out eight.style
  posed train style --experiment styles.toml --out styles.style --report styles.html

Several styles in one model, mixed live by weights: NAME= begins the clips of each.
  posed train style --from plain_1.bvh plain_2.bvh --to feminine=f_1.bvh f_2.bvh \
      elderly=e_1.bvh e_2.bvh --out two.style
  posed apply --model two.style --weights feminine=0.6,elderly=0.4 plain_3.bvh --out mixed.bvh

Several files are takes of one person, unless PERSON: before a name tells them apart. Differences
are learnt within people who show both styles; who shows one adds walks to start from only. On
another day a person walks and acts otherwise, so say which takes are of which day:
  posed train style --from m1.bvh t1.bvh --to m2.bvh t2.bvh --day mon=m1.bvh m2.bvh \
      tue=t1.bvh t2.bvh --out days.style

An experiment file lists clips with their group, subject and motion; several sources and motions
make one model:
  target = "proud"           # or several: ["proud", "sad"]
  mode = "default"           # or "paper"; --mode overrides it
  rate_hz = 30               # --rate overrides it
  pose_space = "humanoid"    # or "native", "cmu43"; --pose-space overrides it
  skeleton = "02.asf"        # of AMC clips, if not beside them; --skeleton overrides it
  [[clip]]
  file = "plain_1.bvh"       # relative to the experiment file
  group = "plain"            # every group that is no target is a source
  subject = "ann"            # who it is, in any group; without it, one person shows all
  motion = "walk"
  day = "monday"             # when it was recorded; without it, all are of one day

The last line says how much of the difference to the target is learnt, tested on clips that were
held out, and how much a fixed change of the pose would be. An unusable model (the groups do not
differ, a clip is not a walk, a held-out walker becomes worse) is not written, and the exit code is
1.)";

// Options that are not given keep the value of the experiment file, or the default.
struct TrainStyleOptions {
  std::vector<std::string> from, to, day;
  std::string experiment, skeleton, out, report;
  std::optional<std::string> motion, pose_space, mode;
  std::optional<double> rate_hz;
  std::uint64_t seed = 0;
  bool overwrite = false, force = false, json = false;
};

// The clips: from the experiment file, or from --from and --to.
Result<Experiment> clips_of(const TrainStyleOptions& options) {
  if (!options.experiment.empty()) {
    if (!options.from.empty() || !options.to.empty()) {
      return misuse("--experiment names the clips itself; leave out --from and --to");
    }
    if (!options.day.empty()) {
      return misuse("--experiment names each clip's day itself (day =); leave out --day");
    }
    if (options.motion) {
      return misuse("--experiment names each clip's motion itself; leave out --motion");
    }
    return read_experiment(options.experiment);
  }
  if (options.from.empty() || options.to.empty()) {
    return misuse("name the clips: --from A.bvh ... --to B.bvh ..., or --experiment FILE.toml");
  }
  Experiment experiment;
  const std::string motion = options.motion.value_or("walk");
  if (motion.empty()) return misuse("--motion is empty; name what the clips show, as in walk");
  for (const std::string& file : options.from) {
    experiment.clips.push_back(named_clip(file, "from", motion));
  }
  TRY(add_target_clips(options.to, motion, experiment));
  TRY(add_days(options.day, experiment));
  return experiment;
}

// The command line overrides the file; a wrong value is refused in either.
Result<Experiment> experiment_of(const TrainStyleOptions& options) {
  std::optional<motion::Space> space;
  if (options.pose_space) {
    space = TRY(motion::space_from_name(*options.pose_space));
  }
  std::optional<style::TrainMode> mode;
  if (options.mode) {
    mode = TRY(style::mode_from_name(*options.mode));
  }
  auto experiment = TRY(clips_of(options));
  if (space) experiment.space = *space;
  experiment.mode = mode.value_or(experiment.mode);
  experiment.rate_hz = options.rate_hz.value_or(experiment.rate_hz);
  if (options.skeleton.empty()) return experiment;
  const auto has_skeleton_file = [](const ExperimentClip& clip) {
    return clip::accepts(clip.file, clip::ReadOption::kSkeleton);
  };
  if (std::ranges::none_of(experiment.clips, has_skeleton_file)) {
    return misuse("--skeleton is only for AMC clips; leave it out");
  }
  experiment.asf = options.skeleton;
  return experiment;
}

// Every file that is read.
std::vector<std::filesystem::path> inputs_of(const TrainStyleOptions& options,
                                             const Experiment& experiment) {
  std::vector<std::filesystem::path> inputs;
  for (const auto& named : {std::filesystem::path(options.experiment), experiment.asf}) {
    if (!named.empty()) inputs.push_back(named);
  }
  for (const ExperimentClip& clip : experiment.clips) {
    inputs.push_back(clip.file);
    const auto skeleton = clip::skeleton_beside(clip.file);
    if (!skeleton.empty() && experiment.asf.empty()) inputs.push_back(skeleton);
  }
  return inputs;
}

// A row for each clip, and what was learnt from them.
void add_summary(const style::Findings& learnt, Findings& findings) {
  const auto stem = [](const std::string& file) {
    return std::filesystem::path(file).stem().string();
  };
  findings.say(fmt::format("{:<12} {:<10} {:<28} {:>8} {:>8}", "group", "motion", "clip", "period",
                           "theta0"));
  for (const style::AlignedClip& clip : learnt.dataset.clips) {
    if (clip.dropped_first) {
      findings.remark(clip.file + ": left out the first frame, a rest pose without motion");
    }
    for (const std::string& what : clip.mended) findings.remark(clip.file + ": " + what);
    findings.say(fmt::format("{:<12} {:<10} {:<28} {:8.2f} {:8.3f}", clip.group, clip.motion,
                             stem(clip.file), 2.0 * std::numbers::pi / clip.dtheta, clip.theta0));
  }
  const gp::Trained& process = learnt.learnt.front().process;
  findings.say(
      fmt::format("{} dimensions of the {} space, {} training poses, kernel length {:.1f} degrees, "
                  "noise {:.3g}",
                  learnt.dataset.dims(), motion::space_name(learnt.dataset.spec.space),
                  process.inputs.rows(), kDegrees / std::sqrt(process.mu), process.noise));
}

// Maps the progress of one training step to that of the whole training, for a single bar.
double overall(std::string_view step, double fraction) {
  if (step == "reading poses") return 0.05 * fraction;
  if (step == "following strides") return 0.05 + 0.15 * fraction;
  if (step == "aligning phases") return 0.2 + 0.1 * fraction;
  return 0.3 + 0.7 * fraction;
}

Result<StyleTraining> train_style(const TrainStyleOptions& options, Ranks& ranks) {
  auto experiment = TRY(experiment_of(options));
  const auto inputs = inputs_of(options, experiment);
  if (ranks.leads()) {
    TRY(OutputFiles(options.overwrite)
            .reads_all(inputs)
            .writes_any_but_other(options.out, {".style"})
            .writes(options.report, {".html"})
            .check());
  }
  TRY(ranks.check_same(inputs));
  return train_and_save(experiment, options.seed,
                        {.model = options.out, .force = options.force, .report = options.report},
                        ranks);
}

}  // namespace

Result<StyleTraining> train_and_save(const Experiment& experiment, std::uint64_t seed,
                                     const StyleFiles& files, Ranks& ranks) {
  const FixedProducts fixed;
  ProgressBar bar;
  if (!bar.show("reading clips", 0.0)) return fail("stopped");
  auto clips = TRY(load_clips(experiment));
  StyleReport page(clips);
  const bool reports = !files.report.empty() && ranks.leads();
  StyleTraining training;
  Findings summary;
  style::TrainOptions options;
  options.target = experiment.targets.front();
  options.more_targets.assign(experiment.targets.begin() + 1, experiment.targets.end());
  options.mode = experiment.mode;
  options.dataset.space = experiment.space.value_or(style::usual_space(clips));
  options.dataset.rate_hz = experiment.rate_hz;
  options.dataset.seed = seed;
  options.dataset.tasks = &ranks.tasks();
  options.dataset.progress = [&bar](std::string_view step, double fraction) {
    return bar.show(step, overall(step, fraction));
  };
  options.look = [&](const style::Findings& learnt) {
    if (reports) page.look(learnt);
    training.verdict = learnt.verdict;
    add_summary(learnt, summary);
  };
  auto model = TRY(style::train_style(clips, options));
  training.written = training.verdict.usable || files.force;
  if (training.written) {
    TRY(ranks.write_model([&] { return style::save_model(model, files.model); }));
  }
  training.seconds = bar.elapsed_s();
  const std::string mode = experiment.mode == style::TrainMode::kPaper ? "paper" : "default";
  training.findings.add_json(model.report_json)
      .add("mode", mode)
      .add("written", training.written)
      .add("seconds", training.seconds)
      .add("out", files.model.string())
      .add_all(summary);
  if (reports) {
    TRY(page.write(training.verdict, mode, training.findings, files.report));
  }
  return training;
}

namespace {

// What is said of a training: at last the verdict.
Findings findings_of(const StyleTraining& training, const std::string& out) {
  const style::TrainingVerdict& verdict = training.verdict;
  Findings findings = training.findings;
  if (training.written) {
    findings.say(
        fmt::format("{0} written after {1:.2f} s; try: posed apply --model {0} IN.bvh --out "
                    "OUT.bvh",
                    out, training.seconds));
  }
  findings.warn(verdict.warnings);
  for (std::size_t i = 1; i < verdict.problems.size(); ++i) findings.remark(verdict.problems[i]);
  return findings.verdict(
      verdict.sentence + (verdict.usable     ? ""
                          : training.written ? "; written, because of --force"
                                             : "; no model was written (--force writes it all the "
                                               "same)"),
      training.written);
}

}  // namespace

void add_train_style(CLI::App& train_command, int& exit_code, const std::shared_ptr<Ranks>& ranks) {
  CLI::App* style = train_command.add_subcommand("style", "Learn what makes one style another");
  style->footer(kTrainStyleFooter);
  const auto options = std::make_shared<TrainStyleOptions>();
  style->add_option("--from", options->from, "Clips of the style to change: [PERSON:]FILE");
  style->add_option("--to", options->to, "Clips of the style to give: [NAME=][PERSON:]FILE");
  style->add_option("--day", options->day,
                    "Which of the clips were recorded on another day: [NAME=]FILE ...");
  style->add_option(
      "--motion", options->motion,
      "What all clips show (default: walk); walk, run, jog, march and gait need strides");
  style->add_option("--experiment", options->experiment,
                    "TOML file that lists the clips and may set mode, rate_hz and pose_space");
  style->add_option("--skeleton", options->skeleton, "NN.asf of AMC clips, if not beside them");
  style->add_option("--pose-space", options->pose_space,
                    "humanoid, native or cmu43 (default: the experiment's, else humanoid where "
                    "all clips show people)");
  style
      ->add_option("--rate", options->rate_hz,
                   "Frames per second to learn at (default: the experiment's, else 30)")
      ->check(in_range(10.0, 1000.0));
  style->add_option("--mode", options->mode,
                    "default, or paper: the paper end to end (default: the experiment's)");
  style->add_option("--seed", options->seed, "Of the random starts")
      ->check(whole_number())
      ->capture_default_str();
  style->add_option("--out", options->out, "Where to write the model")
      ->required()
      ->type_name("OUT.style");
  add_report_option(*style, options->report);
  add_overwrite_option(*style, options->overwrite);
  style->add_flag("--force", options->force, "Write the model even if it is unusable");
  style->add_flag("--json", options->json, "One JSON object on stdout");
  style->callback([options, ranks, &exit_code] {
    const auto trained = train_style(*options, *ranks);
    exit_code =
        trained ? findings_of(*trained, options->out).show(options->json) : report(trained.error());
  });
}

}  // namespace posed::tools
