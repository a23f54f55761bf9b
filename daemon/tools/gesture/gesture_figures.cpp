#include "daemon/tools/gesture/gesture_figures.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/degrees.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/perform/constrain.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::tools {
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

// One angle of each group: of a finger its middle joint's flexion, of a group of joints the one
// that moves most in the training recordings.
std::vector<std::size_t> shown_channels(const gesture::GestureModel& model) {
  std::vector<std::size_t> channels;
  for (const gesture::ChannelGroup& group : model.groups) {
    const auto first = static_cast<std::size_t>(group.first);
    std::size_t shown = first + (model.is_hand() ? 3 : 0);
    const auto range_rad = [&](std::size_t c) { return model.high[c] - model.low[c]; };
    const std::size_t end = model.is_hand() ? 0 : first + static_cast<std::size_t>(group.channels);
    for (std::size_t c = first; c < end; ++c) {
      if (range_rad(c) > range_rad(shown)) shown = c;
    }
    channels.push_back(shown);
  }
  return channels;
}

std::vector<report::AngleTrajectory> no_angles(const gesture::GestureModel& model,
                                               const std::vector<std::size_t>& channels) {
  std::vector<report::AngleTrajectory> angles;
  for (std::size_t g = 0; g < channels.size(); ++g) {
    const std::size_t c = channels[g];
    std::string name = model.groups[g].name + ", middle joint";
    if (!model.is_hand()) {
      name = fmt::format("{}: {} about {}", model.groups[g].name, model.body->joints[c / 3],
                         "xyz"[c % 3]);
    }
    angles.push_back({.name = std::move(name), .recorded = {}, .mean = {}, .low = {}, .high = {}});
  }
  return angles;
}

// Adds one frame of the performance at a time of the figure.
void add_frame(const perform::Performance& performance, int frame, double time_s,
               const std::vector<std::size_t>& channels,
               std::vector<report::AngleTrajectory>& angles) {
  const auto t = static_cast<std::size_t>(frame);
  for (std::size_t g = 0; g < angles.size(); ++g) {
    const std::size_t channel = channels[g];
    const double mean_deg = kDegrees * performance.angles[t][channel];
    const double band_deg =
        kDegrees * kBandDeviations * std::sqrt(performance.variances[t][channel]);
    angles[g].mean.push_back({time_s, mean_deg});
    angles[g].low.push_back({time_s, mean_deg - band_deg});
    angles[g].high.push_back({time_s, mean_deg + band_deg});
  }
}

}  // namespace

std::vector<int> labels_to_show(const gesture::GestureModel& model) {
  if (auto paper = perform::labels_of(model, "g 1 c 3 4 p")) return std::move(*paper);
  std::vector<int> all(model.labels.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

GestureFigures::GestureFigures(std::shared_ptr<const gesture::GestureModel> model,
                               std::vector<int> labels, std::optional<perform::BodyFigure> body)
    : model_(std::move(model)),
      labels_(std::move(labels)),
      information_(model_, model_->rate_hz),
      body_(std::move(body)),
      skeleton_(body_ ? body_->skeleton()
                      : std::make_shared<const Skeleton>(hand_skeleton(Side::kRight))),
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
  if (model_->is_hand()) perform::constrain(performance, default_hand_shape());
  return performance;
}

picture::Figure GestureFigures::pose(const perform::Pose& angles_rad) const {
  if (body_) return shape_.pose(body_->pose(angles_rad).frame);
  Frame frame;
  frame.skeleton = skeleton_->id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton_->joints.size());
  set_hand_angles(*skeleton_, perform::hand_of(angles_rad), frame);
  return shape_.pose(frame);
}

report::Figure GestureFigures::strip_of(const std::string& title, const std::string& sentence,
                                        const std::vector<picture::StripRow>& rows) const {
  const double heading_rad = body_ ? body_->heading_rad() : 0.0;
  return report::gesture_strip(title, sentence, rows,
                               picture::Camera(picture::View::kFront, shape_.facing(heading_rad)),
                               body_.has_value());
}

report::Figure GestureFigures::trajectories_of(const std::string& title,
                                               const std::string& sentence,
                                               const std::vector<report::AngleTrajectory>& angles,
                                               const std::vector<report::LabelSpan>& spans) const {
  return report::angle_trajectories(
      title,
      sentence + (model_->is_hand() ? ""
                                    : " Of each group the angle is shown that moves most in the "
                                      "training recordings, about its mean over them."),
      model_->is_hand() ? "flexion" : "angle", angles, spans);
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
          {.figure = pose(performance.angles[static_cast<std::size_t>(frame)]), .caption = words});
    }
  }
  const char* const part = model_->is_hand() ? "finger" : "group";
  std::string never;
  for (const gesture::Label& label : model_->labels) {
    if (!label.trained) never += (never.empty() ? "" : ", ") + label.name;
  }
  return strip_of(
      "\"" + label_text() + "\" as the model performs it",
      fmt::format("From left to right, two poses a gesture, on the way to it and held, {:.1f} s in "
                  "all; {}.{}",
                  static_cast<double>(performance.angles.size()) / performance.rate_hz,
                  shape_.legend(),
                  never.empty()
                      ? ""
                      : fmt::format(" Never recorded, composed {} by {}: {}.", part, part, never)),
      {row});
}

report::Figure GestureFigures::trajectories() const {
  const auto performance = perform(labels_);
  const auto channels = shown_channels(*model_);
  auto angles = no_angles(*model_, channels);
  for (int t = 0; t < std::ssize(performance.angles); ++t) {
    add_frame(performance, t, t / performance.rate_hz, channels, angles);
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const FrameRange all = range_of(performance, k, 0, gesture::kStates);
    spans.push_back(
        {name(labels_[k]), all.from / performance.rate_hz, all.to / performance.rate_hz});
  }
  return trajectories_of(
      "The performed angles, with what the model leaves open",
      "Lines are what is performed; where the band is wide, recordings differed and the model "
      "leaves room, where it is narrow, the pose is certain. Dashed lines begin a gesture.",
      angles, spans);
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
  const auto channels = shown_channels(*model_);
  auto angles = no_angles(*model_, channels);
  const double period_s = 1.0 / recording.rate_hz;
  for (int t = segments.front().begin; t < segments.back().end; ++t) {
    for (std::size_t g = 0; g < angles.size(); ++g) {
      const auto channel = static_cast<Eigen::Index>(channels[g]);
      angles[g].recorded.push_back({t * period_s, kDegrees * recording.angles_rad(t, channel)});
    }
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const gesture::Segment& segment = segments[k];
    const FrameRange performed = range_of(performance, k, 0, gesture::kStates);
    const double stretch = static_cast<double>(segment.frames()) / (performed.to - performed.from);
    for (int t = performed.from; t < performed.to; ++t) {
      const double frame = segment.begin + (t + 0.5 - performed.from) * stretch;
      add_frame(performance, t, frame * period_s, channels, angles);
    }
    spans.push_back({segment.label, segment.begin * period_s, segment.end * period_s});
  }
  return trajectories_of(
      "A recording and the model's motion for the same labels",
      "The model knows the labels alone; each gesture is stretched to the recorded one's length. "
      "Where the recorded line stays within the band, the model describes this movement.",
      angles, spans);
}

std::optional<report::Figure> GestureFigures::unseen(const gesture::FeatureMatrix& poses,
                                                     const std::string& from) const {
  picture::StripRow performed{.title = "performed", .poses = {}};
  picture::StripRow nearest{.title = "nearest pose of " + from, .poses = {}};
  const auto performance = perform(labels_);
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    if (model_->labels[static_cast<std::size_t>(labels_[k])].trained) continue;
    const int held = range_of(performance, k, kHoldStart, kHoldEnd).middle();
    const perform::Pose& wanted = performance.angles[static_cast<std::size_t>(held)];
    const Eigen::Map<const Eigen::RowVectorXd> row(wanted.data(), poses.cols());
    Eigen::Index at = 0;
    (poses.rowwise() - row).rowwise().squaredNorm().minCoeff(&at);
    const perform::Pose real(poses.row(at).begin(), poses.row(at).end());
    const double off_deg = kDegrees * gesture::apart(*model_, wanted, real).rms_rad();
    performed.poses.push_back({.figure = pose(wanted), .caption = name(labels_[k])});
    const std::string words = fmt::format("{:.1f}° off", off_deg);
    nearest.poses.push_back({.figure = pose(real), .caption = words});
  }
  if (performed.poses.empty()) return std::nullopt;
  return strip_of(
      "Gestures that were never recorded, beside real poses",
      fmt::format(
          "Above what the model composes, below the recorded pose nearest to it (rms over all {}): "
          "a reference that shows these gestures says how right they are; one that does not, how "
          "new.",
          model_->is_hand() ? "angles" : "joints"),
      {performed, nearest});
}

}  // namespace posed::tools
