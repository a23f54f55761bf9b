#include "daemon/cli/models/gesture_figures.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/cli/degrees.hpp"
#include "daemon/report/gesture_sections.hpp"
#include "models/gesture/drawn_tree.hpp"
#include "models/perform/constrain.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::cli {
namespace {

constexpr std::size_t kMostSegments = 8;  // of a recording that are drawn
constexpr double kBandDeviations = 2.0;
constexpr std::size_t kHoldStart = 2, kHoldEnd = 4;  // states, from 0

// Of the gesture's `index`-th label: frames [from, to) of these states.
struct FrameRange {
  int from = 0, to = 0;
  [[nodiscard]] int middle() const { return (from + to) / 2; }
};
FrameRange range_of(const perform::Performance& performance, std::size_t index,
                    std::size_t first_state, std::size_t end_state) {
  const perform::PerformedState* const states = &performance.states[index * gesture::kStates];
  const perform::PerformedState& first = states[first_state];
  const perform::PerformedState& last = states[end_state - 1];
  return {first.start, last.start + last.frames};
}

// The middle joint's flexion of a finger, among the hand's angles.
std::size_t flexion_of(std::size_t finger) { return finger * kFingerChannels + 3; }

report::FingerTrajectory finger_named(std::string_view name) {
  return {.finger = std::string(name) + ", middle joint",
          .recorded = {},
          .mean = {},
          .low = {},
          .high = {}};
}

// Adds one frame of the performance at a time of the figure.
void add_frame(const perform::Performance& performance, int frame, double time_s,
               std::vector<report::FingerTrajectory>& fingers) {
  const auto t = static_cast<std::size_t>(frame);
  for (std::size_t f = 0; f < fingers.size(); ++f) {
    const std::size_t channel = flexion_of(f);
    const double mean_deg = kDegrees * performance.angles[t][channel];
    const double band_deg =
        kDegrees * kBandDeviations * std::sqrt(performance.variances[t][channel]);
    fingers[f].mean.push_back({time_s, mean_deg});
    fingers[f].low.push_back({time_s, mean_deg - band_deg});
    fingers[f].high.push_back({time_s, mean_deg + band_deg});
  }
}

std::vector<report::FingerTrajectory> all_fingers() {
  std::vector<report::FingerTrajectory> fingers(kFingerNames.size());
  std::ranges::transform(kFingerNames, fingers.begin(), finger_named);
  return fingers;
}

report::QuestionTree question_tree(const gesture::DrawnTree& tree) {
  report::QuestionTree out{tree.title, {}};
  for (const gesture::DrawnNode& node : tree.nodes) {
    out.nodes.push_back({node.words, node.reach, node.yes, node.no});
  }
  return out;
}

}  // namespace

std::vector<int> labels_to_show(const gesture::GestureModel& model) {
  if (auto paper = perform::labels_of(model, "g 1 c 3 4 p")) return std::move(*paper);
  std::vector<int> all(model.labels.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

GestureFigures::GestureFigures(std::shared_ptr<const gesture::GestureModel> model,
                               std::vector<int> labels)
    : model_(std::move(model)),
      labels_(std::move(labels)),
      information_(model_, model_->rate_hz),
      skeleton_(std::make_shared<const Skeleton>(hand_skeleton(Side::kRight))),
      shape_(skeleton_) {}

const std::string& GestureFigures::name(int label) const {
  return model_->labels[static_cast<std::size_t>(label)].name;
}

std::string GestureFigures::label_text() const {
  std::string text;
  for (const int label : labels_) text += (text.empty() ? "" : " ") + name(label);
  return text;
}

perform::Performance GestureFigures::perform(std::span<const int> labels) const {
  auto performance = perform::perform(information_, labels, {});
  perform::constrain(performance, default_hand_shape());
  return performance;
}

picture::Figure GestureFigures::pose(const HandAngles& angles_rad) const {
  Frame frame;
  frame.skeleton = skeleton_->id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton_->joints.size());
  set_hand_angles(*skeleton_, angles_rad, frame);
  return shape_.pose(frame);
}

report::Figure GestureFigures::strip() const {
  const auto performance = perform(labels_);
  picture::StripRow row;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const std::string& label = name(labels_[k]);
    const int moving = range_of(performance, k, 0, kHoldStart).middle();
    const int held = range_of(performance, k, kHoldStart, kHoldEnd).middle();
    for (const auto& [frame, words] : {std::pair(moving, "to " + label), std::pair(held, label)}) {
      row.poses.push_back(
          {.figure = pose(perform::hand_of(performance.angles[static_cast<std::size_t>(frame)])),
           .caption = words});
    }
  }
  std::string never;
  for (const gesture::Label& label : model_->labels) {
    if (!label.trained) never += (never.empty() ? "" : ", ") + label.name;
  }
  return report::hand_strip(
      "\"" + label_text() + "\" as the model performs it",
      fmt::format(
          "From left to right, two poses a gesture, on the way to it and held, {:.1f} s in "
          "all; {}.{}",
          static_cast<double>(performance.angles.size()) / performance.rate_hz, shape_.legend(),
          never.empty() ? "" : " Never recorded, composed finger by finger: " + never + "."),
      {row}, picture::Camera(picture::View::kFront, shape_.facing(0.0)));
}

report::Figure GestureFigures::trajectories() const {
  const auto performance = perform(labels_);
  auto fingers = all_fingers();
  for (int t = 0; t < std::ssize(performance.angles); ++t) {
    add_frame(performance, t, t / performance.rate_hz, fingers);
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const FrameRange all = range_of(performance, k, 0, gesture::kStates);
    spans.push_back(
        {name(labels_[k]), all.from / performance.rate_hz, all.to / performance.rate_hz});
  }
  return report::finger_trajectories(
      "The performed angles, with what the model leaves open",
      "Lines are what is performed; where the band is wide, recordings differed and the model "
      "leaves room, where it is narrow, the pose is certain. Dashed lines begin a gesture.",
      fingers, spans);
}

std::optional<report::Figure> GestureFigures::over(const gesture::Recording& recording) const {
  std::vector<gesture::Segment> segments;
  std::vector<int> labels;
  for (const gesture::Segment& segment : recording.segments) {
    const int label = model_->label_index(segment.label);
    if (label < 0 || segments.size() == kMostSegments) break;
    segments.push_back(segment);
    labels.push_back(label);
  }
  if (labels.empty()) return std::nullopt;
  const auto performance = perform(labels);
  auto fingers = all_fingers();
  const double period_s = 1.0 / recording.rate_hz;
  for (int t = segments.front().begin; t < segments.back().end; ++t) {
    for (std::size_t f = 0; f < fingers.size(); ++f) {
      const auto channel = static_cast<Eigen::Index>(flexion_of(f));
      fingers[f].recorded.push_back({t * period_s, kDegrees * recording.angles_rad(t, channel)});
    }
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const gesture::Segment& segment = segments[k];
    const FrameRange performed = range_of(performance, k, 0, gesture::kStates);
    const double stretch = static_cast<double>(segment.frames()) / (performed.to - performed.from);
    for (int t = performed.from; t < performed.to; ++t) {
      const double frame = segment.begin + (t + 0.5 - performed.from) * stretch;
      add_frame(performance, t, frame * period_s, fingers);
    }
    spans.push_back({segment.label, segment.begin * period_s, segment.end * period_s});
  }
  return report::finger_trajectories(
      "A recording and the model's motion for the same labels",
      "The model knows the labels alone; each gesture is stretched to the recorded one's length. "
      "Where the recorded line stays within the band, the model describes this hand.",
      fingers, spans);
}

std::optional<report::Figure> GestureFigures::unseen(const gesture::FeatureMatrix& poses,
                                                     const std::string& from) const {
  picture::StripRow performed{.title = "performed", .poses = {}};
  picture::StripRow nearest{.title = "nearest pose of " + from, .poses = {}};
  const auto performance = perform(labels_);
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    if (model_->labels[static_cast<std::size_t>(labels_[k])].trained) continue;
    const int held = range_of(performance, k, kHoldStart, kHoldEnd).middle();
    const HandAngles angles = perform::hand_of(performance.angles[static_cast<std::size_t>(held)]);
    const Eigen::Map<const Eigen::RowVectorXd> wanted(angles.data(), kHandChannels);
    Eigen::Index at = 0;
    const double squares = (poses.rowwise() - wanted).rowwise().squaredNorm().minCoeff(&at);
    HandAngles real{};
    std::copy_n(poses.row(at).data(), kHandChannels, real.begin());
    performed.poses.push_back({.figure = pose(angles), .caption = name(labels_[k])});
    nearest.poses.push_back(
        {.figure = pose(real),
         .caption = fmt::format("{:.1f}° off", kDegrees * std::sqrt(squares / kHandChannels))});
  }
  if (performed.poses.empty()) return std::nullopt;
  return report::hand_strip(
      "Gestures that were never recorded, beside real poses",
      "Above what the model composes, below the recorded pose nearest to it (rms over all angles): "
      "a reference that shows these gestures says how right they are; one that does not, how new.",
      {performed, nearest}, picture::Camera(picture::View::kFront, shape_.facing(0.0)));
}

report::Figure GestureFigures::durations() const {
  std::vector<report::LabelDurations> all;
  for (int label = 0; label < std::ssize(model_->labels); ++label) {
    const gesture::DurationGaussian& frames = gesture::duration(*model_, {label, label, label});
    report::LabelDurations durations{
        .label = name(label),
        .recorded = model_->labels[static_cast<std::size_t>(label)].trained,
        .mean_s = {},
        .deviation_s = {}};
    for (std::size_t s = 0; s < gesture::kStates; ++s) {
      durations.mean_s.push_back(frames.mean[s] / model_->rate_hz);
      durations.deviation_s.push_back(std::sqrt(frames.variance[s]) / model_->rate_hz);
    }
    all.push_back(std::move(durations));
  }
  return report::state_durations(all);
}

std::vector<report::Figure> GestureFigures::trees() const {
  constexpr int kMiddle = 2, kFourth = 3;  // the tree that the paper shows
  const auto drawn = [&](const gesture::TreeChoice& choice) {
    std::vector<report::QuestionTree> trees;
    for (const auto& tree : gesture::draw_trees(*model_, choice)) {
      trees.push_back(question_tree(tree));
    }
    return trees;
  };
  std::vector<report::Figure> figures{
      report::decision_trees("The decision tree of the middle finger in state 4",
                             drawn({.state = kFourth, .group = kMiddle}), false)};
  for (int f = 0; f < kFingers; ++f) {
    figures.push_back(report::decision_trees(
        fmt::format("All trees of the {} finger", kFingerNames[static_cast<std::size_t>(f)]),
        drawn({.state = -1, .group = f}), true));
  }
  return figures;
}

report::Figure GestureFigures::lag(std::span<const LagPoint> curve) const {
  std::vector<report::LagError> errors;
  for (const LagPoint& point : curve) {
    errors.push_back({point.frames, point.rms_deg, point.max_deg, point.jerk_ratio});
  }
  return report::lag_error(errors, model_->rate_hz);
}

}  // namespace posed::cli
