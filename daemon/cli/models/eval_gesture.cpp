// `posed eval gesture`: measures what a gesture model performs.
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <ostream>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/degrees.hpp"
#include "daemon/cli/models/gesture_data.hpp"
#include "daemon/cli/models/gesture_report.hpp"
#include "daemon/cli/models/lag_curve.hpp"
#include "daemon/cli/models/tree_options.hpp"
#include "daemon/cli/models/waiting.hpp"
#include "daemon/cli/output_files.hpp"
#include "models/gesture/model_file.hpp"
#include "models/motion/naturalness.hpp"
#include "models/perform/constrain.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/json_text.hpp"

namespace posed::cli {
namespace {

using nlohmann::json;

constexpr const char* kEvalGestureFooter = R"(Examples:
  posed eval gesture --model hand.gesture
  posed eval gesture --model hand.gesture --labels "g 1 c 3 4 p" --reference hand.csv --json
  posed eval gesture --model hand.gesture --svg lag.svg --tree-svg tree.svg --trees middle:4
  posed eval gesture --model hand.gesture --reference take2.csv --reference-labels take2.lab \
      --report hand.html

jerk: rms third difference, deg/frame^3; ldlj and sparc: smoothness of the speed, closer to 0 is
smoother; nearest_reference_deg: distance to the nearest recorded frame, rms over the performed
frames and the angles that move; frechet: distance of the Gaussians of windows of 30 frames
[deg^2]; min_gap_cm: between any two bones, before and after the constraint stage. The curve says
how much worse a performance is that knows its labels only so many frames ahead.)";

struct EvalGestureOptions {
  std::string model, reference, reference_labels, labels, svg, report;
  bool overwrite = false, json = false;
  std::shared_ptr<TreeOptions> trees = std::make_shared<TreeOptions>();
};

// Of poses of a hand, recorded or performed.
template <typename Poses>
motion::Rows degrees_of(const Poses& angles) {
  motion::Rows rows(static_cast<Eigen::Index>(angles.size()), kHandChannels);
  for (Eigen::Index t = 0; t < rows.rows(); ++t) {
    rows.row(t) = kDegrees * Eigen::Map<const Eigen::RowVectorXd>(
                                 angles[static_cast<std::size_t>(t)].data(), kHandChannels);
  }
  return rows;
}

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json smoothness(const motion::Rows& rows, double rate_hz) {
  const Eigen::VectorXd speed = motion::speed_of(rows, rate_hz);
  const std::span<const double> values(speed.data(), static_cast<std::size_t>(speed.size()));
  return {{"frames", rows.rows()},
          {"jerk", motion::jerk_rms(rows)},
          {"ldlj", number(motion::log_dimensionless_jerk(values, rate_hz))},
          {"sparc", number(motion::spectral_arc_length(values, rate_hz))}};
}

// The distance of each frame to the nearest frame of `reference`: rms over all frames and the
// channels that move.
double nearest_deg(const motion::Rows& rows, const motion::Rows& reference) {
  const Eigen::RowVectorXd low = reference.colwise().minCoeff();
  const auto moving = ((reference.colwise().maxCoeff() - low).array() > 1.0).count();
  double squares = 0.0;
  for (Eigen::Index t = 0; t < rows.rows(); ++t) {
    squares += (reference.rowwise() - rows.row(t)).rowwise().squaredNorm().minCoeff();
  }
  return std::sqrt(squares / static_cast<double>(rows.rows() * std::max<Eigen::Index>(1, moving)));
}

Result<json> against(const std::string& path, const motion::Rows& rows) {
  auto clip = clip::read_hand_clip(path);
  if (!clip) return std::unexpected(clip.error());
  clip::fill_gaps(*clip);
  if (clip->angles.size() < 4) return fail("the reference has fewer than four frames", path);
  const motion::Rows recorded = degrees_of(clip->angles);
  json report = smoothness(recorded, clip->rate_hz);
  report["nearest_reference_deg"] = nearest_deg(rows, recorded);
  if (const auto distance = motion::motion_distance(rows, recorded)) {
    report["frechet"] = *distance;
  } else {
    report["frechet"] = nullptr;
    report["frechet_missing"] = distance.error().text();
  }
  return report;
}

json leaves_of(const gesture::GestureModel& model) {
  json states = json::array();
  std::size_t total = 0;
  for (const auto& state : model.trees) {
    json fingers;
    for (int f = 0; f < kFingers; ++f) {
      fingers[std::string(kFingerNames[f])] = state[f].leaves.size();
      total += state[f].leaves.size();
    }
    states.push_back(fingers);
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

// The last line: whether the performance is good enough to be shown.
std::string verdict(const json& report) {
  const double gap_cm = report["min_gap_cm"].get<double>();
  std::string text = gap_cm >= 0.0 ? "fingers never overlap" : "fingers overlap";
  if (report.contains("reference")) {
    const json& reference = report["reference"];
    text += fmt::format(
        "; the motion is {:.1f} deg (rms of an angle) from the nearest recorded "
        "pose and {:.2f} times as rough as the recording",
        reference["nearest_reference_deg"].get<double>(),
        report["performed"]["jerk"].get<double>() / reference["jerk"].get<double>());
  } else {
    text += "; --reference RECORDING shows how close it is to a real hand";
  }
  return text;
}

// The recording to compare with, cut at its labels if it has some.
Result<std::vector<gesture::Recording>> compared_with(const EvalGestureOptions& options,
                                                      double rate_hz) {
  std::vector<gesture::Recording> recordings;
  if (options.reference.empty()) return recordings;
  if (!options.reference_labels.empty()) {
    auto labelled = load_recording(options.reference, options.reference_labels, rate_hz);
    if (!labelled) return std::unexpected(labelled.error());
    recordings.push_back(std::move(*labelled));
    return recordings;
  }
  auto clip = clip::read_hand_clip(options.reference);
  if (!clip) return std::unexpected(clip.error());
  clip::fill_gaps(*clip);
  auto recording = gesture::recording_of(*clip, rate_hz);
  if (!recording) return std::unexpected(recording.error());
  recordings.push_back(std::move(*recording));
  return recordings;
}

Result<> write_report(const EvalGestureOptions& options, const gesture::GestureModel& model,
                      const std::vector<int>& labels, const std::vector<LagPoint>& curve,
                      const json& report) {
  if (options.report.empty()) return {};
  const auto recordings = compared_with(options, model.rate_hz);
  if (!recordings) return std::unexpected(recordings.error());
  return write_gesture_report({.title = "Evaluation of gestures",
                               .command = "posed eval gesture",
                               .recorded_by = "the reference",
                               .labels = labels,
                               .good = report["min_gap_cm"].get<double>() >= 0.0,
                               .curve = curve},
                              std::make_shared<const gesture::GestureModel>(model), *recordings,
                              report, options.report);
}

Result<json> evaluate_gesture(const EvalGestureOptions& options) {
  OutputFiles files(options.overwrite);
  if (auto checked = check_tree_options(*options.trees, files); !checked) {
    return std::unexpected(checked.error());
  }
  files.reads(options.model)
      .reads(options.reference)
      .reads(options.reference_labels)
      .writes_any_but_other(options.svg, {".svg"})
      .writes(options.report, {".html"});
  if (auto checked = files.check(); !checked) return std::unexpected(checked.error());
  auto model = gesture::load_model(options.model);
  if (!model) return std::unexpected(model.error());
  if (!model->is_hand()) {
    return misuse(
        "the model is of a body, and the figures are of hands; perform it with `posed "
        "synth` and measure that with `posed eval natural`",
        options.model);
  }
  if (auto drawn = draw_trees(*model, *options.trees); !drawn) {
    return std::unexpected(drawn.error());
  }
  std::string text = options.labels;
  if (text.empty()) {
    for (const gesture::Label& label : model->labels) text += label.name + " ";
  }
  const auto labels = perform::labels_of(*model, text);
  if (!labels) return std::unexpected(labels.error());
  const double rate_hz = model->rate_hz;
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(std::move(*model)), rate_hz);
  auto performance = perform::perform(information, *labels, {});
  const auto kept = perform::constrain(performance, default_hand_shape());
  const motion::Rows rows = degrees_of(performance.angles);
  const auto curve = lag_curve(information, *labels);
  json report{{"labels", text},
              {"performed", smoothness(rows, rate_hz)},
              {"min_gap_cm", 100.0 * kept.min_gap_m},
              {"min_gap_before_cm", 100.0 * kept.before_m},
              {"leaves", leaves_of(information.model())},
              {"curve", curve_json(curve)}};
  if (!options.reference.empty()) {
    auto reference = against(options.reference, rows);
    if (!reference) return std::unexpected(reference.error());
    report["reference"] = *reference;
  }
  if (!options.svg.empty()) {
    const std::string drawing = draw_lag_curve(curve, rate_hz);
    const auto written = clip::write_text(options.svg, [&](std::ostream& out) { out << drawing; });
    if (!written) return std::unexpected(written.error());
    report["svg"] = options.svg;
  }
  report["verdict"] = verdict(report);
  if (auto written = write_report(options, information.model(), *labels, curve, report); !written) {
    return std::unexpected(written.error());
  }
  return report;
}

void print_figures(const char* what, const json& figures) {
  std::printf("%-10s", what);
  for (const auto& [name, value] : figures.items()) {
    if (value.is_number()) std::printf("  %s %.4g", name.c_str(), value.get<double>());
  }
  std::printf("\n");
}

void print_report(const json& report) {
  print_figures("performed", report["performed"]);
  if (report.contains("reference")) print_figures("reference", report["reference"]);
  std::printf("fingers    %.3f cm apart at least, %.3f before the constraints\n",
              report["min_gap_cm"].get<double>(), report["min_gap_before_cm"].get<double>());
  std::printf("leaves     %d in 25 trees\n\n", report["leaves"]["total"].get<int>());
  std::printf("error of an angle at a look-ahead of so many frames:\n");
  std::printf("%10s %10s %10s %10s\n", "look-ahead", "rms deg", "max deg", "jerk ratio");
  for (const json& point : report["curve"]) {
    std::printf("%10d %10.4f %10.4f %10.3f\n", point["lookahead"].get<int>(),
                point["channel_rms_deg"].get<double>(), point["channel_max_deg"].get<double>(),
                point["jerk_ratio"].get<double>());
  }
}

int finish(const json& report, bool as_json) {
  if (as_json) {
    std::printf("%s\n", json_text(report, 2).c_str());
  } else {
    print_report(report);
  }
  std::fflush(stdout);
  std::fprintf(stderr, "posed: %s\n", report["verdict"].get<std::string>().c_str());
  return static_cast<int>(report["min_gap_cm"].get<double>() >= 0.0 ? ExitCode::kDone
                                                                    : ExitCode::kFailed);
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
  auto* page = add_report_option(*command, options->report);
  command
      ->add_option("--reference-labels", options->reference_labels,
                   "Its labels, to show which are recognised")
      ->needs(reference)
      ->needs(page);
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

}  // namespace posed::cli
