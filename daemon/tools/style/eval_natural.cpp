// `posed eval natural`: whether people move as a clip does, measured beside a corpus of clips.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/command/ranks.hpp"
#include "daemon/tools/report/page.hpp"
#include "daemon/tools/style/natural_clips.hpp"
#include "models/natural/compare.hpp"
#include "proto/clip/format.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr const char* kEvalNaturalFooter = R"(Examples:
  posed eval natural styled.bvh --corpus walks
  posed eval natural hand.csv --corpus recordings --json
  posed eval natural take.bvh --corpus takes --hand right    # the fingers of bodies
  posed eval natural styled.bvh --corpus walks --report natural.html
  posed eval natural takes/*.bvh --corpus walks --json | jq -s 'flatten | .[] | .clip, .natural'

Each figure of the clip stands beside the same figure of the corpus' clips: median, 5th and 95th
percentile, and the share of them that is below. Each of these is measured against the others, the
clip against all. A natural clip of one person may lie outside for one figure by chance; what is
further out than the percentiles are apart is called unnatural, and the exit code is 1.

All clips are brought to one rate; what is faster than a third of it does not count.
jerk: rms third difference of the angles [deg/frame^3]; sparc: spectral arc length of their speed,
closer to 0 is smoother; frechet_deg2: distance of the Gaussians of windows of 30 frames (each
angle's mean and mean change); beyond_deg: how far an angle goes beyond its range in the others, at
most; of bodies also slide_cm_s: speed over the ground of ankles and toes slower than 10 cm/s;
sink_cm: how far the lowest toe is below the height at which toes stand. Angles are the components
of the joints' rotation vectors about the clip's mean pose; of hands, the 45 angles.

Persons are compared by the bones of hips, trunk, head, arms and legs that all clips have, whatever
their joints are called; other figures by the names of their joints. Clips without them, and clips
shorter than 49 frames, are left out and listed. Each clip of a corpus of several persons, who are
told apart by the lengths of their limbs, is measured against those of the others. Fewer than ten
persons do not show how much people differ, so at least a usual difference is allowed.)";

struct EvalNaturalOptions : NaturalOptions {
  std::vector<std::filesystem::path> clips;  // each becomes `clip`
  ReportFile report;
  bool json = false;
};

// What makes the spread of this corpus a rough one; empty: nothing.
std::string doubts(const natural::Comparison& comparison, std::size_t clips) {
  constexpr std::size_t kFewClips = 10;
  std::string out;
  if (comparison.persons > 0 && comparison.persons < natural::kMinPersons) {
    out = fmt::format(
        "the corpus is of {}, so people may differ by a usual amount, too",
        comparison.persons == 1 ? "one person" : fmt::format("{} persons", comparison.persons));
  }
  if (clips >= kFewClips) return out;
  return fmt::format("{}{}the corpus has {} clips, and fewer than {} have a rough spread", out,
                     out.empty() ? "" : "; ", clips, kFewClips);
}

// " (leftHand)": the joint that goes beyond its range.
std::string furthest_joint(const natural::Placed& placed, const NaturalClips& clips,
                           const natural::Comparison& comparison) {
  const auto joint = static_cast<std::size_t>(comparison.furthest / 3);
  if (placed.name != "beyond_deg" || joint >= clips.joints.size()) return {};
  return " (" + clean_name(clips.joints[joint]) + ")";
}

std::string natural_verdict(const natural::Comparison& comparison, const NaturalClips& clips) {
  std::string out;
  for (const natural::Placed& placed : comparison.figures) {
    if (placed.natural) continue;
    const std::string value = std::isfinite(placed.value)
                                  ? fmt::format("is {:.3g}", placed.value)
                                  : "cannot be measured (feet that never stand, or a still figure)";
    out += fmt::format("{}{} {}{}, the corpus has {:.3g} to {:.3g}",
                       out.empty() ? "not natural: " : "; ", placed.name, value,
                       furthest_joint(placed, clips, comparison), placed.p5, placed.p95);
  }
  if (!out.empty()) return out;
  return fmt::format("natural by all {} figures, beside {} clips", comparison.figures.size(),
                     clips.corpus.size());
}

Findings findings_of(const EvalNaturalOptions& options, const NaturalClips& clips,
                     const natural::Comparison& comparison) {
  Findings figures;
  figures.say(fmt::format("{:<14} {:>10}   {:>10} {:>10} {:>10} {:>8}", "figure", "clip", "p5",
                          "median", "p95", "below"));
  for (const natural::Placed& placed : comparison.figures) {
    figures.add(placed.name, Findings()
                                 .add("value", placed.value)
                                 .add("p5", placed.p5)
                                 .add("median", placed.median)
                                 .add("p95", placed.p95)
                                 .add("below", placed.below)
                                 .add("natural", placed.natural)
                                 .say(fmt::format("{:<14} {:10.4g}   {:10.4g} {:10.4g} {:10.4g} "
                                                  "{:6.0f} %{}",
                                                  placed.name, placed.value, placed.p5,
                                                  placed.median, placed.p95, 100.0 * placed.below,
                                                  placed.natural ? "" : "  unnatural")));
  }
  std::vector<Findings> left_out;
  for (const LeftOut& file : clips.left_out) {
    left_out.push_back(Findings().add("file", file.file).add("why", file.why));
  }
  const bool natural = std::ranges::all_of(comparison.figures, &natural::Placed::natural);
  std::string verdict = natural_verdict(comparison, clips);
  Findings findings;
  if (options.clips.size() > 1) {
    findings.say(options.clip.string());
    verdict = options.clip.string() + ": " + verdict;
  }
  findings.add("clip", options.clip.string())
      .add("corpus", options.corpus.string())
      .add("clips", clips.corpus.size())
      .add("persons", comparison.persons)
      .add("doubts", doubts(comparison, clips.corpus.size()))
      .add("left_out", left_out)
      .add("rate_hz", options.rate_hz)
      .add("dimensions", comparison.dimensions)
      .add("figures", figures)
      .add("natural", natural)
      .add("verdict", verdict);
  if (!clips.left_out.empty()) {
    const LeftOut& first = clips.left_out.front();
    findings.remark(fmt::format("warning: {} clips left out: {} ({}){}", left_out.size(),
                                first.file, first.why,
                                left_out.size() > 1 ? ", ...; --json lists them" : ""));
  }
  const std::string rough = doubts(comparison, clips.corpus.size());
  if (!rough.empty()) findings.remark("note: " + rough);
  return findings.verdict(verdict, natural);
}

Result<> write_natural_report(const natural::Comparison& comparison, const NaturalClips& clips,
                              const Findings& findings, const std::filesystem::path& path) {
  report::Page page("Whether people move so", "posed eval natural");
  const bool natural = std::ranges::all_of(comparison.figures, &natural::Placed::natural);
  page.verdict(natural_verdict(comparison, clips), natural);
  report::Table table{
      .columns =
          {{"figure", false}, {"clip"}, {"p5"}, {"median"}, {"p95"}, {"below, %"}, {"", false}},
      .rows = {}};
  for (const natural::Placed& placed : comparison.figures) {
    std::vector<std::string> row{placed.name};
    for (const double value : {placed.value, placed.p5, placed.median, placed.p95}) {
      row.push_back(report::number_text(value, 3));
    }
    row.push_back(report::number_text(100.0 * placed.below, 0));
    row.emplace_back(placed.natural ? "" : "unnatural");
    table.rows.push_back(std::move(row));
  }
  page.section("Beside the corpus");
  page.add({.title = "Each figure of the clip and of the corpus' clips",
            .sentence = "p5 and p95: one in twenty of the corpus' clips is below, one above. "
                        "`posed eval natural --help` says what the figures are.",
            .drawings = {},
            .tables = {std::move(table)}});
  add_json(findings, page);
  return report::write_page(page, path);
}

Result<Findings> evaluate_natural(const EvalNaturalOptions& options) {
  TRY(OutputFiles(options.report.overwrite)
          .reads(options.clip)
          .writes(options.report.path, {".html"})
          .check());
  if (!options.skeleton.empty() && !clip::accepts(options.clip, clip::ReadOption::kSkeleton)) {
    return misuse("--skeleton is only for AMC clips; leave it out");
  }
  ProgressBar bar(kQuietFor_s);
  ThreadTasks tasks;
  constexpr double kReading = 0.9;  // of the progress
  const auto clips = TRY(read_natural_clips(options, tasks, [&bar](double fraction) {
    return bar.show("reading the corpus", kReading * fraction);
  }));
  const auto comparison =
      natural::compare(clips.clip, clips.corpus, tasks, [&bar](double fraction) {
        return bar.show("comparing", kReading + (1.0 - kReading) * fraction);
      });
  if (!comparison) return fail("stopped");
  bar.finish();
  Findings findings = findings_of(options, clips, *comparison);
  if (options.report.wanted()) {
    TRY(write_natural_report(*comparison, clips, findings, options.report.path));
  }
  return findings;
}

// Each clip is measured about its own mean pose, and so is the corpus beside it.
Result<Findings> evaluate_each(EvalNaturalOptions options) {
  if (options.clips.size() > 1 && options.report.wanted()) {
    return misuse("--report is of one clip; name one, or leave it out");
  }
  std::vector<Findings> list;
  for (const std::filesystem::path& clip : options.clips) {
    options.clip = clip;
    auto one = evaluate_natural(options);
    if (!one && options.clips.size() == 1) return std::unexpected(one.error());
    if (!one) {  // the others are judged all the same
      const std::string why = one.error().text();
      one = Findings().add("clip", clip.string()).add("error", why).verdict(why, false);
    }
    list.push_back(std::move(*one));
  }
  if (list.size() == 1) return list.front();
  Findings all;
  all.add({}, list);
  for (const Findings& findings : list) all.take_sentences(findings);
  return all;
}

}  // namespace

void add_eval_natural(CLI::App& eval, int& exit_code) {
  CLI::App* command = eval.add_subcommand("natural", "Whether people move as a clip does");
  command->footer(kEvalNaturalFooter);
  const auto options = std::make_shared<EvalNaturalOptions>();
  command->add_option("clip", options->clips, "Clips to judge: " + clip::listed(clip::Use::kRead))
      ->required();
  command->add_option("--corpus", options->corpus, "Folder of clips of people")->required();
  command->add_option("--hand", options->hand, "left or right: judge this hand of clips of bodies")
      ->check(CLI::IsMember({"left", "right"}));
  command->add_option("--skeleton", options->skeleton,
                      "NN.asf of an AMC clip, and of those of the corpus without one beside them");
  command->add_option("--rate", options->rate_hz, "Frames per second at which to compare")
      ->check(in_range(10.0, 1000.0))
      ->capture_default_str();
  add_report_file(*command, options->report);
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] {
    const auto made = evaluate_each(*options);
    exit_code = made ? made->show(options->json) : report(made.error());
  });
}

}  // namespace posed::tools
