#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "daemon/tools/gesture/gesture_figures.hpp"
#include "daemon/tools/report/gesture_sections.hpp"
#include "models/gesture/pose_channels.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/time.hpp"

namespace posed::tools {
namespace {

constexpr const char* kNoGesture = "none";

// Notes the label of each frame that the smoother emits.
class RecognisedLabels final : public StageOut {
 public:
  explicit RecognisedLabels(Eigen::Index frames) : labels(static_cast<std::size_t>(frames)) {}
  void frame(const StageFrame& made) noexcept override {
    const std::uint64_t sequence = made.frame.header.sequence;
    if (sequence >= 1 && sequence <= labels.size()) labels[sequence - 1] = made.frame.label;
  }
  std::vector<std::array<char, kMaxLabel>> labels;  // [frame]
};

// `first`: a frame of the figure, whose channels the recording's poses replace.
std::vector<std::array<char, kMaxLabel>> recognised_in(const gesture::Recording& recording,
                                                       const Skeleton& skeleton, const Frame& first,
                                                       const gesture::PoseChannels& channels,
                                                       const smooth::LiveModel& model) {
  smooth::LiveSmoother smoother(skeleton, {}, &model);
  RecognisedLabels out(recording.angles_rad.rows());
  for (Eigen::Index t = 0; t < recording.angles_rad.rows(); ++t) {
    const auto row = recording.angles_rad.row(t);
    Frame frame = first;
    channels.write({row.data(), static_cast<std::size_t>(row.size())}, 0.0, frame);
    frame.header.sequence = static_cast<std::uint64_t>(t + 1);
    frame.header.device_ns = nanoseconds(static_cast<double>(t) / recording.rate_hz);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  return std::move(out.labels);
}

using Counts = std::map<std::string, std::map<std::string, int>>;  // [given][recognised]

report::Confusion shares_of(const Counts& counts, const std::vector<std::string>& labels,
                            const std::string& measured_on) {
  report::Confusion confusion{
      .labels = labels, .given = {}, .share = {}, .frames = {}, .measured_on = measured_on};
  const bool some_none = std::ranges::any_of(
      counts, [](const auto& given) { return given.second.contains(kNoGesture); });
  if (some_none) confusion.labels.emplace_back(kNoGesture);
  for (const auto& [given, row] : counts) {
    int sum = 0;
    for (const auto& [label, count] : row) sum += count;
    std::vector<double> shares;
    for (const std::string& label : confusion.labels) {
      const auto found = row.find(label);
      shares.push_back(found == row.end() ? 0.0 : static_cast<double>(found->second) / sum);
    }
    confusion.given.push_back(given);
    confusion.share.push_back(std::move(shares));
    confusion.frames.push_back(sum);
  }
  return confusion;
}

}  // namespace

std::optional<report::Figure> confusion_of(const gesture::GestureModel& model,
                                           const clip::Clip& body,
                                           const std::vector<gesture::Recording>& recordings,
                                           const std::string& measured_on) {
  const Skeleton skeleton = model.is_hand() ? hand_skeleton(Side::kRight) : *body.skeleton;
  const Frame first = model.is_hand() ? Frame{} : body.frame(0);
  const auto live = smooth::bind_live_model(model, skeleton, "the model");
  const auto channels = gesture::PoseChannels::bind(model, skeleton);
  if (!live || !channels) return std::nullopt;
  Counts counts;
  for (const gesture::Recording& recording : recordings) {
    const auto recognised = recognised_in(recording, skeleton, first, *channels, **live);
    for (const gesture::Segment& segment : recording.segments) {
      for (int t = segment.begin; t < segment.end; ++t) {
        const std::string label = recognised[static_cast<std::size_t>(t)].data();
        ++counts[segment.label][label.empty() ? kNoGesture : label];
      }
    }
  }
  if (counts.empty()) return std::nullopt;
  std::vector<std::string> labels;
  for (const auto& [given, row] : counts) labels.push_back(given);
  for (const gesture::Label& label : model.labels) {
    const bool there = std::ranges::find(labels, label.name) != labels.end();
    if (label.trained && !there) labels.push_back(label.name);
  }
  return report::label_confusion(shares_of(counts, labels, measured_on));
}

}  // namespace posed::tools
