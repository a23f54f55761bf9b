// `posed eval gesture`: measures what a gesture model performs.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
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
#include "daemon/tools/gesture/gesture_data.hpp"
#include "daemon/tools/gesture/gesture_report.hpp"
#include "daemon/tools/gesture/tree_options.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/gesture/train.hpp"
#include "models/motion/naturalness.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/constrain.hpp"
#include "models/perform/perform.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

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

// How smooth a motion is, as --help explains; NaN where a figure is not defined.
struct Smoothness {
  Eigen::Index frames = 0;
  double jerk = 0.0, ldlj = 0.0, sparc = 0.0;
  std::vector<double> jerk_of_groups;
};

// A reference, and how far the performance is from it.
struct Beside {
  Smoothness reference;
  double nearest_deg = 0.0;
  Result<double> frechet;
};

// How far a held pose is from the recorded one [deg]: as performed, and, where recordings are
// given, what they give without a model: their nearest pose, their mean pose, and the best that can
// be composed of their groups.
constexpr std::array<const char*, 4> kHoldNames{"deg", "nearest_recorded_deg", "constant_deg",
                                                "best_composition_deg"};
using HoldDistances = std::vector<double>;  // one, or one for each name
struct Hold {
  std::string label;
  bool recorded = true;
  HoldDistances all;
  std::vector<HoldDistances> groups;
};
struct Holds {
  HoldDistances all;
  std::vector<Hold> labels;

  [[nodiscard]] bool without_model() const { return all.size() > 1; }
};

struct FingerGap {
  double kept_m = 0.0, before_m = 0.0;  // with the constraints, and without
};

struct GestureEvaluation {
  std::string labels;
  Smoothness performed{};
  std::vector<report::LagError> curve{};
  std::optional<FingerGap> gap{};
  std::optional<double> feet_off_m{};
  std::optional<Beside> beside{};
  std::optional<Holds> holds{};

  // Whether the performance is good enough to be shown: fingers do not overlap; the held poses of a
  // body are nearer to real ones than the mean pose of the training recordings is, where those are
  // known.
  [[nodiscard]] bool good() const {
    if (gap) return gap->kept_m >= 0.0;
    return !holds || !holds->without_model() || holds->all[0] < holds->all[2];
  }
};

motion::Rows degrees_of(const gesture::Recording& recording) {
  return kDegrees * recording.angles_rad;
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

Smoothness smoothness(const gesture::Vocabulary& vocabulary, const gesture::Recording& motion) {
  const motion::Rows rows = degrees_of(motion);
  const Eigen::VectorXd speed = motion::speed_of(rows, motion.rate_hz);
  const std::span<const double> values(speed.data(), speed.size());
  Smoothness smoothness{.frames = rows.rows(),
                        .jerk = motion::jerk_rms(rows),
                        .ldlj = motion::log_dimensionless_jerk(values, motion.rate_hz),
                        .sparc = motion::spectral_arc_length(values, motion.rate_hz),
                        .jerk_of_groups = {}};
  for (const gesture::ChannelGroup& group : vocabulary.groups) {
    smoothness.jerk_of_groups.push_back(
        motion::jerk_rms(rows.middleCols(group.first, group.channels)));
  }
  return smoothness;
}

// Returns an error for a reference of fewer than four frames.
Result<Beside> against(const gesture::Vocabulary& vocabulary, const gesture::Recording& performed,
                       const gesture::Recording& reference) {
  const motion::Rows rows = degrees_of(performed), recorded = degrees_of(reference);
  if (recorded.rows() < 4) return fail("the reference has fewer than four frames", reference.file);
  return Beside{smoothness(vocabulary, reference), nearest_deg(rows, recorded),
                motion::motion_distance(rows, recorded)};
}

// The poses that the recorded ones [frame][channel] give for `wanted` without a model.
std::vector<std::vector<double>> without_model(const gesture::Vocabulary& vocabulary,
                                               const gesture::FeatureMatrix& recorded,
                                               const std::vector<double>& wanted) {
  const gesture::FeatureMatrix off =
      recorded.rowwise() - Eigen::Map<const Eigen::RowVectorXd>(wanted.data(), recorded.cols());
  Eigen::Index at = 0;
  off.rowwise().squaredNorm().minCoeff(&at);
  std::vector<double> composed(wanted.size());
  for (const gesture::ChannelGroup& group : vocabulary.groups) {
    Eigen::Index best = 0;
    off.middleCols(group.first, group.channels).rowwise().squaredNorm().minCoeff(&best);
    const double* const from = recorded.row(best).data() + group.first;
    std::copy_n(from, group.channels, composed.begin() + group.first);
  }
  const Eigen::RowVectorXd mean = recorded.colwise().mean();
  return {{recorded.row(at).begin(), recorded.row(at).end()}, {mean.begin(), mean.end()}, composed};
}

// The reference's segments whose labels the model has.
gesture::Recording known_part(const gesture::GestureModel& model,
                              const gesture::Recording& reference) {
  gesture::Recording known = reference;
  std::erase_if(known.segments, [&](const gesture::Segment& segment) {
    return model.label_index(segment.label) < 0;
  });
  return known;
}

// The distances of the poses in all and in each group, and the label of the wanted pose.
Hold hold_of(const gesture::GestureModel& model, const gesture::LabelPose& wanted,
             const std::vector<std::vector<double>>& poses) {
  const int label = model.label_index(wanted.name);
  Hold hold{.label = wanted.name,
            .recorded = model.labels[label].trained,
            .all = {},
            .groups = std::vector<HoldDistances>(model.groups.size())};
  for (const std::vector<double>& pose : poses) {
    hold.all.push_back(kDegrees * gesture::apart(model, pose, wanted.angles_rad).rms_rad());
    for (std::size_t g = 0; g < model.groups.size(); ++g) {
      hold.groups[g].push_back(
          kDegrees * gesture::apart(model, model.groups[g], pose, wanted.angles_rad).rms_rad());
    }
  }
  return hold;
}

// How far the model's held poses are from those of a labelled reference, where the model performs
// the reference's own labels; `recorded` may be empty. Returns an error where the model knows none
// of the labels.
Result<Holds> hold_errors(const trajectory::StateInformation& information,
                          const gesture::Recording& reference,
                          const std::vector<gesture::Recording>& recorded) {
  const gesture::GestureModel& model = information.model();
  const gesture::Recording known = known_part(model, reference);
  if (known.segments.empty()) {
    return misuse("the model has none of the reference's labels; give labels that it has",
                  reference.file);
  }
  std::vector<int> labels;
  labels.reserve(known.segments.size());
  for (const gesture::Segment& segment : known.segments) {
    labels.push_back(model.label_index(segment.label));
  }
  auto performance = TRY(perform::perform(information, labels, {}));
  if (model.is_hand()) perform::constrain(performance, default_hand_shape());
  const auto performed = gesture::label_poses({perform::recording_of(model, performance)});
  const auto wanted = gesture::label_poses({known});  // the same names in the same order
  const auto poses = recorded.empty() ? gesture::FeatureMatrix() : all_poses(recorded);
  Holds holds;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    std::vector<std::vector<double>> candidates{performed[i].angles_rad};
    if (!recorded.empty()) {
      std::ranges::move(without_model(model, poses, wanted[i].angles_rad),
                        std::back_inserter(candidates));
    }
    holds.labels.push_back(hold_of(model, wanted[i], candidates));
  }
  for (std::size_t n = 0; n < (recorded.empty() ? 1 : kHoldNames.size()); ++n) {
    double squares = 0.0;
    for (const Hold& hold : holds.labels) squares += hold.all[n] * hold.all[n];
    holds.all.push_back(std::sqrt(squares / static_cast<double>(holds.labels.size())));
  }
  return holds;
}

Findings findings_of(const Smoothness& smoothness, const gesture::Vocabulary& vocabulary) {
  Findings groups;
  for (std::size_t g = 0; g < vocabulary.groups.size(); ++g) {
    groups.add(vocabulary.groups[g].name, smoothness.jerk_of_groups[g]);
  }
  return Findings()
      .add("frames", smoothness.frames)
      .add("jerk", smoothness.jerk)
      .add("ldlj", smoothness.ldlj)
      .add("sparc", smoothness.sparc)
      .add("jerk_of_groups", groups);
}

// "performed   frames 120  jerk 0.1": the figures that are defined.
std::string figures_line(const std::string& what, const Findings& figures) {
  std::string line = fmt::format("{:<10}", what);
  for (const char* name : {"frechet", "frames", "jerk", "ldlj", "nearest_reference_deg", "sparc"}) {
    const auto value = figures.number(name);
    if (value && std::isfinite(*value)) line += fmt::format("  {} {:.4g}", name, *value);
  }
  return line;
}

Findings findings_of(const Beside& beside, const gesture::Vocabulary& vocabulary) {
  Findings findings = findings_of(beside.reference, vocabulary);
  findings.add("nearest_reference_deg", beside.nearest_deg)
      .add("frechet", beside.frechet ? std::optional(*beside.frechet) : std::nullopt);
  if (!beside.frechet) findings.add("frechet_missing", beside.frechet.error().text());
  return findings;
}

// A line of the held poses' table.
Findings findings_of(const HoldDistances& distances, const std::string& name) {
  Findings findings;
  std::string line = fmt::format("{:<16}", name);
  for (std::size_t n = 0; n < distances.size(); ++n) {
    findings.add(kHoldNames[n], distances[n]);
    line += fmt::format(" {:10.2f}", distances[n]);
  }
  return findings.say(std::move(line));
}

Findings findings_of(const Holds& holds, const gesture::Vocabulary& vocabulary) {
  Findings findings;
  for (std::size_t n = 0; n < holds.all.size(); ++n) findings.add(kHoldNames[n], holds.all[n]);
  findings
      .say(fmt::format("held poses, deg rms from the recorded ones{}:",
                       holds.without_model() ? ", and without a model" : ""))
      .say(fmt::format("{:<16} {:>10}{}", "", "performed",
                       holds.without_model()
                           ? fmt::format(" {:>10} {:>10} {:>10}", "nearest", "constant", "composed")
                           : ""));
  std::vector<Findings> rows;
  for (const Hold& hold : holds.labels) {
    Findings row = findings_of(hold.all, hold.label + (hold.recorded ? "" : " (new)"));
    row.add("label", hold.label).add("recorded", hold.recorded);
    Findings groups;
    for (std::size_t g = 0; g < hold.groups.size(); ++g) {
      const std::string& group = vocabulary.groups[g].name;
      groups.add(group, findings_of(hold.groups[g], "  " + group));
    }
    rows.push_back(row.add("groups", groups));
  }
  return findings.add("labels", rows).say("");
}

Findings leaves_of(const gesture::GestureModel& model) {
  std::vector<Findings> states;
  std::size_t total = 0;
  for (const auto& state : model.trees) {
    Findings groups;
    for (std::size_t g = 0; g < model.groups.size(); ++g) {
      groups.add(model.groups[g].name, state[g].leaves.size());
      total += state[g].leaves.size();
    }
    states.push_back(groups);
  }
  return Findings()
      .add("total", total)
      .add("states", states)
      .add("durations", model.durations.leaves.size())
      .say(fmt::format("leaves     {} in {} trees", total, states.size() * model.groups.size()))
      .say("");
}

// "held poses are 2.1 deg from the recorded ones (a constant pose 30.2, ...)"
std::string hold_words(const Holds& holds) {
  std::string text = fmt::format("held poses are {:.1f} deg from the recorded ones", holds.all[0]);
  if (!holds.without_model()) return text;
  return text + fmt::format(" (the nearest pose learnt from {:.1f}, a constant pose {:.1f})",
                            holds.all[1], holds.all[2]);
}

std::string gesture_verdict(const GestureEvaluation& evaluation) {
  std::vector<std::string> parts;
  if (evaluation.gap) {
    parts.emplace_back(evaluation.good() ? "fingers never overlap" : "fingers overlap");
  }
  if (evaluation.holds) parts.push_back(hold_words(*evaluation.holds));
  if (const auto& beside = evaluation.beside) {
    parts.push_back(
        fmt::format("the motion is {:.1f} deg (rms of an angle) from the nearest recorded pose and "
                    "{:.2f} times as rough as the recording",
                    beside->nearest_deg, evaluation.performed.jerk / beside->reference.jerk));
  } else {
    parts.push_back(fmt::format("--reference RECORDING shows how close it is to a real {}",
                                evaluation.gap ? "hand" : "body"));
  }
  return joined(parts, "; ");
}

// All but the verdict.
Findings findings_of(const GestureEvaluation& evaluation, const gesture::GestureModel& model) {
  Findings findings;
  const Findings performed = findings_of(evaluation.performed, model);
  findings.add("labels", evaluation.labels)
      .add("performed", performed)
      .say(figures_line("performed", performed));
  if (evaluation.beside) {
    const Findings reference = findings_of(*evaluation.beside, model);
    findings.add("reference", reference).say(figures_line("reference", reference));
  }
  if (const auto& gap = evaluation.gap) {
    findings.add("min_gap_cm", 100.0 * gap->kept_m)
        .add("min_gap_before_cm", 100.0 * gap->before_m)
        .say(fmt::format("fingers    {:.3f} cm apart at least, {:.3f} before the constraints",
                         100.0 * gap->kept_m, 100.0 * gap->before_m));
  }
  if (const auto& off_m = evaluation.feet_off_m) {
    findings.add("feet_off_cm", 100.0 * *off_m)
        .say(fmt::format("feet       within {:.2f} cm of their places", 100.0 * *off_m));
  }
  findings.add("leaves", leaves_of(model));
  if (evaluation.holds) findings.add("holds", findings_of(*evaluation.holds, model));
  findings.say("error of an angle at a look-ahead of so many frames:")
      .say(fmt::format("{:>10} {:>10} {:>10} {:>10}", "look-ahead", "rms deg", "max deg",
                       "jerk ratio"));
  std::vector<Findings> curve;
  curve.reserve(evaluation.curve.size());
  for (const report::LagError& point : evaluation.curve) {
    curve.push_back(Findings()
                        .add("lookahead", point.frames)
                        .add("channel_rms_deg", point.rms_deg)
                        .add("channel_max_deg", point.max_deg)
                        .add("jerk_ratio", point.jerk_ratio)
                        .say(fmt::format("{:10} {:10.4f} {:10.4f} {:10.3f}", point.frames,
                                         point.rms_deg, point.max_deg, point.jerk_ratio)));
  }
  return findings.add("curve", curve);
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
  auto reference = TRY(recordings_for(model, references));
  if (!options.reference_labels.empty()) {
    TRY(cut_at(reference.front(), options.reference_labels));
  }
  auto recorded = TRY(recordings_for(model, options.recorded));
  return Compared{std::move(reference), std::move(recorded)};
}

Result<> check(const EvalGestureOptions& options, const gesture::GestureModel& model) {
  OutputFiles files(options.overwrite);
  TRY(check_tree_options(*options.trees, files, model.groups));
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

// Measures what only a hand, or only a body, is measured by; the hand's constraints are kept.
Result<> measure_space(const EvalGestureOptions& options, const gesture::GestureModel& model,
                       perform::Performance& performance, GestureEvaluation& evaluation) {
  if (model.is_hand()) {
    const auto kept = perform::constrain(performance, default_hand_shape());
    evaluation.gap = {kept.min_gap_m, kept.before_m};
    return {};
  }
  if (options.reference.empty()) return {};
  const auto body = TRY(figure_of(model, options.reference));
  const auto performed = TRY(perform::perform_on(model, performance, body));
  evaluation.feet_off_m = performed.feet_off_m;
  return {};
}

// Measures how the performance compares with recordings.
Result<> compare(const trajectory::StateInformation& information,
                 const gesture::Recording& performed, const Compared& compared,
                 GestureEvaluation& evaluation) {
  if (compared.reference.empty()) return {};
  const gesture::Recording& reference = compared.reference.front();
  auto beside = TRY(against(information.model(), performed, reference));
  evaluation.beside = std::move(beside);
  if (reference.segments.empty()) return {};
  auto holds = TRY(hold_errors(information, reference, compared.recorded));
  evaluation.holds = std::move(holds);
  return {};
}

Result<> write_report(const EvalGestureOptions& options,
                      const std::shared_ptr<const gesture::GestureModel>& model,
                      const std::vector<int>& labels, const Compared& compared,
                      const GestureEvaluation& evaluation, const Findings& findings) {
  if (options.report.empty()) return {};
  auto body = TRY(figure_of(*model, options.reference));
  return write_gesture_report({.title = "Evaluation of gestures",
                               .command = "posed eval gesture",
                               .recorded_by = "the reference",
                               .labels = labels,
                               .verdict = gesture_verdict(evaluation),
                               .good = evaluation.good(),
                               .curve = evaluation.curve,
                               .body = std::move(body)},
                              model, compared.reference, findings, options.report);
}

Result<Findings> evaluate_gesture(const EvalGestureOptions& options) {
  auto loaded = TRY(gesture::load_model(options.model));
  TRY(check(options, loaded));
  const auto model = std::make_shared<const gesture::GestureModel>(std::move(loaded));
  TRY(draw_trees(*model, *options.trees));
  GestureEvaluation evaluation{.labels = options.labels};
  if (options.labels.empty()) {
    for (const gesture::Label& label : model->labels) evaluation.labels += label.name + " ";
  }
  const auto labels = TRY(perform::labels_of(*model, evaluation.labels));
  const auto compared = TRY(compared_with(options, *model));
  const trajectory::StateInformation information(model, model->rate_hz);
  auto performance = TRY(perform::perform(information, labels, {}));
  TRY(measure_space(options, *model, performance, evaluation));
  const gesture::Recording performed = perform::recording_of(*model, performance);
  evaluation.performed = smoothness(*model, performed);
  auto curve = TRY(lag_curve(information, labels));
  evaluation.curve = std::move(curve);
  TRY(compare(information, performed, compared, evaluation));
  Findings findings = findings_of(evaluation, *model);
  if (!options.svg.empty()) {
    const auto figure = report::lag_error(evaluation.curve, model->rate_hz);
    TRY(write_whole_file(options.svg, report::svg_file(figure.drawings)));
    findings.add("svg", options.svg);
  }
  const std::string verdict = gesture_verdict(evaluation);
  findings.add("verdict", verdict).verdict(verdict, evaluation.good());
  TRY(write_report(options, model, labels, compared, evaluation, findings));
  return findings;
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
    exit_code = made ? made->show(options->json) : report(made.error());
  });
}

}  // namespace posed::tools
