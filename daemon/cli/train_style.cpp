#include <cstdio>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/experiment.hpp"
#include "daemon/cli/progress.hpp"
#include "daemon/cli/train_style.hpp"
#include "models/style/train.hpp"

namespace posed::cli {
namespace {

using nlohmann::json;

constexpr const char* kTrainStyleFooter = R"(Examples:
  posed train style --from plain_1.bvh plain_2.bvh --to proud_1.bvh proud_2.bvh --out proud.style
  posed train style --motion walk --from 02_02.amc 35_01.amc --to 08_01.amc --pose-space cmu43 \
      --out eight.style
  posed train style --experiment styles.toml --out styles.style --json

An experiment file lists clips with their group, subject and motion; several sources and motions
make one model:
  target = "proud"
  [[clip]]
  file = "plain_1.bvh"       # relative to the experiment file
  group = "plain"            # every group but the target is a source
  subject = "ann"            # default: the file's stem
  motion = "walk")";

struct TrainStyleOptions {
  std::vector<std::string> from, to;
  std::string motion = "walk", experiment, skeleton, out;
  std::string pose_space = "native", mode = "default";
  double rate_hz = 30.0;
  std::uint64_t seed = 0;
  bool json = false;
};

// The command line's own form of an experiment: each clip is one subject.
Result<Experiment> experiment_of(const TrainStyleOptions& options) {
  if (!options.experiment.empty()) {
    if (!options.from.empty() || !options.to.empty()) {
      return misuse("--experiment names the clips itself; leave out --from and --to");
    }
    return read_experiment(options.experiment);
  }
  if (options.from.empty() || options.to.empty()) {
    return misuse("name the clips: --from A.bvh ... --to B.bvh ..., or --experiment FILE.toml");
  }
  Experiment experiment;
  experiment.target = "to";
  experiment.rate_hz = options.rate_hz;
  experiment.asf = options.skeleton;
  for (const auto* files : {&options.from, &options.to}) {
    for (const std::string& file : *files) {
      experiment.clips.push_back({file, files == &options.from ? "from" : "to",
                                  std::filesystem::path(file).stem().string(), options.motion, 0});
    }
  }
  auto space = motion::space_from_name(options.pose_space);
  if (!space) return std::unexpected(space.error());
  experiment.space = *space;
  auto mode = style::mode_from_name(options.mode);
  if (!mode) return std::unexpected(mode.error());
  experiment.mode = *mode;
  return experiment;
}

void print_style_summary(const json& report, const std::string& out) {
  std::printf("%-12s %-10s %-28s %8s %8s\n", "group", "motion", "clip", "period", "theta0");
  for (const json& clip : report["clips"]) {
    if (clip["dropped_first_frame"].get<bool>()) {
      std::fprintf(stderr, "%s: left out the first frame, a rest pose that is no motion\n",
                   clip["file"].get<std::string>().c_str());
    }
    const auto stem = std::filesystem::path(clip["file"].get<std::string>()).stem().string();
    std::printf("%-12s %-10s %-28s %8.2f %8.3f\n", clip["group"].get<std::string>().c_str(),
                clip["motion"].get<std::string>().c_str(), stem.c_str(),
                clip["period_frames"].get<double>(), clip["theta0"].get<double>());
  }
  std::printf("%d dimensions, %d training poses, kernel length %.1f degrees, noise %.3g\n",
              report["dims"].get<int>(), report["training_points"].get<int>(),
              report["kernel"]["length_deg"].get<double>(), report["noise"].get<double>());
  std::printf("%s written after %.2f s; try: posed apply --model %s IN.bvh --out OUT.bvh\n",
              out.c_str(), report["seconds"].get<double>(), out.c_str());
}

// Shares of the whole that the steps of a training take, for one bar over all of them.
double overall(std::string_view step, double fraction) {
  if (step == "reading poses") return 0.05 * fraction;
  if (step == "aligning phases") return 0.05 + 0.85 * fraction;
  return 0.9 + 0.1 * fraction;
}

Result<json> train_style(const TrainStyleOptions& options) {
  auto experiment = experiment_of(options);
  if (!experiment) return std::unexpected(experiment.error());
  return train_and_save(*experiment, options.seed, options.out);
}

}  // namespace

Result<json> train_and_save(const Experiment& experiment, std::uint64_t seed,
                            const std::filesystem::path& out) {
  ProgressBar bar;
  if (!bar.show("reading clips", 0.0)) return fail("stopped");
  auto clips = load_clips(experiment);
  if (!clips) return std::unexpected(clips.error());
  style::TrainOptions options;
  options.target = experiment.target;
  options.mode = experiment.mode;
  options.dataset.space = experiment.space;
  options.dataset.rate_hz = experiment.rate_hz;
  options.dataset.seed = seed;
  options.dataset.progress = [&bar](std::string_view step, double fraction) {
    return bar.show(step, overall(step, fraction));
  };
  auto model = style::train_style(*clips, options);
  if (!model) return std::unexpected(model.error());
  if (auto saved = style::save_model(*model, out); !saved) return std::unexpected(saved.error());
  json report = json::parse(model->report_json);
  report["seconds"] = bar.elapsed_s();
  report["out"] = out.string();
  return report;
}

void add_train_style(CLI::App& train_command, int& exit_code) {
  CLI::App* style = train_command.add_subcommand("style", "Learn what makes one style another");
  style->footer(kTrainStyleFooter);
  const auto options = std::make_shared<TrainStyleOptions>();
  style->add_option("--from", options->from, "Clips of the style to change");
  style->add_option("--to", options->to, "Clips of the style to give");
  style->add_option("--motion", options->motion, "What all clips show")->capture_default_str();
  style->add_option("--experiment", options->experiment, "TOML file that lists the clips");
  style->add_option("--skeleton", options->skeleton, "NN.asf of AMC clips, if not beside them");
  style->add_option("--pose-space", options->pose_space, "native, cmu43 or humanoid")
      ->capture_default_str();
  style->add_option("--rate", options->rate_hz, "Frames per second to learn at")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  style->add_option("--mode", options->mode, "default, or paper: the paper end to end")
      ->capture_default_str();
  style->add_option("--seed", options->seed, "Of the random starts")->capture_default_str();
  style->add_option("--out", options->out, "Where to write the model")->required();
  style->add_flag("--json", options->json, "One JSON object on stdout");
  style->callback([options, &exit_code] {
    const auto report_or = train_style(*options);
    if (!report_or) {
      exit_code = report(report_or.error());
    } else if (options->json) {
      std::printf("%s\n", report_or->dump(2).c_str());
    } else {
      print_style_summary(*report_or, options->out);
    }
  });
}

}  // namespace posed::cli
