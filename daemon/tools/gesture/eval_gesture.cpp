// `posed eval gesture`: measures what a gesture model performs.
#include <cstdio>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/waiting.hpp"
#include "daemon/tools/gesture/gesture_data.hpp"
#include "daemon/tools/gesture/gesture_measures.hpp"
#include "daemon/tools/gesture/gesture_report.hpp"
#include "daemon/tools/gesture/gesture_words.hpp"
#include "daemon/tools/gesture/lag_curve.hpp"
#include "daemon/tools/gesture/tree_options.hpp"
#include "models/gesture/model_file.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/constrain.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

using nlohmann::json;

constexpr const char* kEvalGestureFooter = R"(Examples:
  posed eval gesture --model hand.gesture
  posed eval gesture --model hand.gesture --labels "g 1 c 3 4 p" --reference hand.csv --json
  posed eval gesture --model hand.gesture --svg lag.svg --tree-svg tree.svg --trees middle:4
  posed eval gesture --model hand.gesture --reference take2.csv --reference-labels take2.lab \
      --report hand.html
  posed eval gesture --model body.gesture --labels "raise-both rest" --reference both.bvh \
      --reference-labels both.lab --recorded left.bvh right.bvh

jerk: rms third difference, deg/frame^3; ldlj and sparc: smoothness of the speed, closer to 0 is
smoother; nearest_reference_deg: distance to the nearest recorded frame, rms over the performed
frames and the angles that move; frechet: distance of the Gaussians of windows of 30 frames
[deg^2]; min_gap_cm: between any two bones, before and after the constraint stage. holds: how far
held poses are from the labelled reference's, over a hand's angles or a body's joints, and beside
them, with --recorded, those recordings' nearest pose to it, their mean pose, and the best that can
be composed of their fingers or groups. The curve says how much worse a performance is that knows
its labels only so many frames ahead.)";

struct EvalGestureOptions {
  std::string model, reference, reference_labels, labels, svg, report;
  std::vector<std::string> recorded;
  bool overwrite = false, json = false;
  std::shared_ptr<TreeOptions> trees = std::make_shared<TreeOptions>();
};

json leaves_of(const gesture::GestureModel& model) {
  json states = json::array();
  std::size_t total = 0;
  for (const auto& state : model.trees) {
    json groups;
    for (std::size_t g = 0; g < model.groups.size(); ++g) {
      groups[model.groups[g].name] = state[g].leaves.size();
      total += state[g].leaves.size();
    }
    states.push_back(groups);
  }
  return {{"total", total}, {"states", states}, {"durations", model.durations.leaves.size()}};
}

json curve_json(const std::vector<LagPoint>& curve) {
  json points = json::array();
  for (const LagPoint& point : curve) {
    points.push_back({{"lookahead", point.frames},
                      {"channel_rms_deg", point.rms_deg},
                      {"channel_max_deg", point.max_deg},
                      {"jerk_ratio", point.jerk_ratio}});
  }
  return points;
}

// The recordings that the command was given, as the model sees them.
struct Compared {
  std::vector<gesture::Recording> reference;  // one, cut at its labels if it has some, or none
  std::vector<gesture::Recording> recorded;
};
Result<Compared> compared_with(const EvalGestureOptions& options,
                               const gesture::GestureModel& model) {
  std::vector<std::string> references;
  if (!options.reference.empty()) references.push_back(options.reference);
  auto reference = recordings_for(model, references);
  if (!reference) return std::unexpected(reference.error());
  if (!options.reference_labels.empty()) {
    const auto done = cut_at(reference->front(), options.reference_labels);
    if (!done) return std::unexpected(done.error());
  }
  auto recorded = recordings_for(model, options.recorded);
  if (!recorded) return std::unexpected(recorded.error());
  return Compared{std::move(*reference), std::move(*recorded)};
}

Result<> write_report(const EvalGestureOptions& options, const gesture::GestureModel& model,
                      const std::vector<int>& labels, const std::vector<LagPoint>& curve,
                      const Compared& compared, const json& report) {
  if (options.report.empty()) return {};
  auto body = figure_of(model, options.reference);
  if (!body) return std::unexpected(body.error());
  return write_gesture_report({.title = "Evaluation of gestures",
                               .command = "posed eval gesture",
                               .recorded_by = "the reference",
                               .labels = labels,
                               .good = gesture_is_good(report),
                               .curve = curve,
                               .body = std::move(*body)},
                              std::make_shared<const gesture::GestureModel>(model),
                              compared.reference, report, options.report);
}

Result<> check(const EvalGestureOptions& options, const gesture::GestureModel& model) {
  OutputFiles files(options.overwrite);
  if (auto trees = check_tree_options(*options.trees, files, model.groups); !trees) return trees;
  if (!model.is_hand() && !options.report.empty() && options.reference.empty()) {
    return misuse(
        "a body's report is drawn on the figure of a recording; add --reference TAKE.bvh");
  }
  return files.reads(options.model)
      .reads(options.reference)
      .reads(options.reference_labels)
      .reads_all(options.recorded)
      .writes_any_but_other(options.svg, {".svg"})
      .writes(options.report, {".html"})
      .check();
}

// What only a hand, or only a body, is measured by; the hand's constraints are kept.
Result<json> space_figures(const EvalGestureOptions& options, const gesture::GestureModel& model,
                           perform::Performance& performance) {
  if (model.is_hand()) {
    const auto kept = perform::constrain(performance, default_hand_shape());
    return json{{"min_gap_cm", 100.0 * kept.min_gap_m},
                {"min_gap_before_cm", 100.0 * kept.before_m}};
  }
  if (options.reference.empty()) return json::object();
  const auto body = figure_of(model, options.reference);
  if (!body) return std::unexpected(body.error());
  const auto performed = perform::perform_on(model, performance, *body);
  if (!performed) return std::unexpected(performed.error());
  return json{{"feet_off_cm", 100.0 * performed->feet_off_m}};
}

// Adds how the performance compares with recordings.
Result<> compare(const trajectory::StateInformation& information,
                 const gesture::Recording& performed, const Compared& compared, json& report) {
  if (compared.reference.empty()) return {};
  const gesture::Recording& reference = compared.reference.front();
  auto beside = against(information.model(), performed, reference);
  if (!beside) return std::unexpected(beside.error());
  report["reference"] = std::move(*beside);
  if (reference.segments.empty()) return {};
  auto holds = hold_errors(information, reference, compared.recorded);
  if (!holds) return std::unexpected(holds.error());
  report["holds"] = std::move(*holds);
  return {};
}

Result<json> evaluate_gesture(const EvalGestureOptions& options) {
  auto loaded = gesture::load_model(options.model);
  if (!loaded) return std::unexpected(loaded.error());
  if (auto checked = check(options, *loaded); !checked) return std::unexpected(checked.error());
  const auto model = std::make_shared<const gesture::GestureModel>(std::move(*loaded));
  if (auto drawn = draw_trees(*model, *options.trees); !drawn) {
    return std::unexpected(drawn.error());
  }
  std::string text = options.labels;
  if (text.empty()) {
    for (const gesture::Label& label : model->labels) text += label.name + " ";
  }
  const auto labels = perform::labels_of(*model, text);
  if (!labels) return std::unexpected(labels.error());
  const auto compared = compared_with(options, *model);
  if (!compared) return std::unexpected(compared.error());
  const trajectory::StateInformation information(model, model->rate_hz);
  auto performance = perform::perform(information, *labels, {});
  auto figures = space_figures(options, *model, performance);
  if (!figures) return figures;
  const gesture::Recording performed = perform::recording_of(*model, performance);
  const auto curve = lag_curve(information, *labels);
  json report{{"labels", text},
              {"performed", smoothness(*model, performed)},
              {"leaves", leaves_of(*model)},
              {"curve", curve_json(curve)}};
  report.update(*figures);
  if (auto done = compare(information, performed, *compared, report); !done) {
    return std::unexpected(done.error());
  }
  if (!options.svg.empty()) {
    const std::string drawing = draw_lag_curve(curve, model->rate_hz);
    const auto written = clip::write_text(options.svg, [&](std::ostream& out) { out << drawing; });
    if (!written) return std::unexpected(written.error());
    report["svg"] = options.svg;
  }
  report["verdict"] = gesture_verdict(report);
  if (auto written = write_report(options, *model, *labels, curve, *compared, report); !written) {
    return std::unexpected(written.error());
  }
  return report;
}

int finish(const json& report, bool as_json) {
  if (as_json) {
    std::printf("%s\n", json_text(report, 2).c_str());
  } else {
    print_gesture_report(report);
  }
  std::fflush(stdout);
  std::fprintf(stderr, "posed: %s\n", report["verdict"].get<std::string>().c_str());
  return static_cast<int>(gesture_is_good(report) ? ExitCode::kDone : ExitCode::kFailed);
}

}  // namespace

void add_eval_gesture(CLI::App& eval, int& exit_code) {
  CLI::App* command = eval.add_subcommand("gesture", "What a gesture model performs, in figures");
  command->footer(kEvalGestureFooter);
  const auto options = std::make_shared<EvalGestureOptions>();
  command->add_option("--model", options->model, "Model from `posed train gesture`")->required();
  command->add_option("--labels", options->labels, "What to perform (default: every label once)");
  auto* reference =
      command->add_option("--reference", options->reference, "A recording to compare with");
  command->add_option("--svg", options->svg, "Where to draw look-ahead against error");
  add_tree_options(*command, options->trees);
  add_report_option(*command, options->report);
  auto* labelled = command->add_option("--reference-labels", options->reference_labels,
                                       "Its labels, to compare held poses with");
  labelled->needs(reference);
  command
      ->add_option("--recorded", options->recorded,
                   "Recordings that the model learnt from: what they give without it")
      ->needs(labelled);
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] {
    const auto made = [&] {
      const Waiting waiting("performing at every look-ahead");
      return evaluate_gesture(*options);
    }();
    exit_code = made ? finish(*made, options->json) : report(made.error());
  });
}

}  // namespace posed::tools
