// Passes hand motions through the live smoother with a gesture model; shared by the tests of the
// model.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_hand.hpp"

namespace posed::test {

inline gesture::Recording recording_of(const SyntheticHand& hand) {
  gesture::Recording recording;
  recording.file = "synthetic hand";
  recording.rate_hz = 30.0;
  recording.angles_rad = hand.angles * kDegree;
  for (std::size_t i = 0; i < hand.spans.size(); ++i) {
    recording.segments.push_back(
        {hand.spans[i].first, hand.spans[i].second, std::string(1, hand.labels[i])});
  }
  return recording;
}

// Grasps mapped to the hand's joints, which are an unknown motion for a model of g, c, p. [frames x
// 45] deg; every `step`-th frame.
inline Motion unknown_hand(const std::filesystem::path& grasps, int step = 1) {
  // The hand45 indices of the 19 sensors (thumb roll and two joints, abduction, then finger by
  // finger); this glove's flexion is negative when closing.
  constexpr std::array<int, 19> kAngle{2,  3,  6,  1,  9,  12, 15, 10, 18, 21,
                                       24, 27, 30, 33, 28, 36, 39, 42, 37};
  const Motion sensors = grasp_reference(grasps);
  Motion hand = Motion::Zero((sensors.rows() + step - 1) / step, kHandChannels);
  for (Eigen::Index t = 0; t < hand.rows(); ++t) {
    for (std::size_t s = 0; s < kAngle.size(); ++s) {
      const double sign = kAngle[s] % 3 == 0 ? -1.0 : 1.0;
      hand(t, kAngle[s]) = sign * sensors(t * step, static_cast<Eigen::Index>(s));
    }
  }
  return hand;
}

struct Followed {
  Motion angles;  // [frames x 45] deg
  std::vector<std::string> label;
  std::vector<double> probability;
};

inline Followed followed(const Motion& measured, double rate_hz, const smooth::LiveOptions& options,
                         const smooth::LiveModel* model) {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  smooth::LiveSmoother smoother(skeleton, options, model);
  Frames out;
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    HandAngles angles{};
    for (Eigen::Index c = 0; c < kHandChannels; ++c) {
      angles[static_cast<std::size_t>(c)] = measured(t, c) * kDegree;
    }
    Frame frame;
    set_hand_angles(skeleton, angles, frame);
    frame.header.sequence = static_cast<std::uint64_t>(t + 1);
    frame.header.device_ns = nanoseconds(static_cast<double>(t) / rate_hz);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  Followed result;
  result.angles.resize(measured.rows(), kHandChannels);
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    const HandAngles angles = hand_angles(out.all[t]);
    for (Eigen::Index c = 0; c < kHandChannels; ++c) {
      result.angles(static_cast<Eigen::Index>(t), c) =
          angles[static_cast<std::size_t>(c)] / kDegree;
    }
    result.label.emplace_back(out.all[t].label.data());
    result.probability.push_back(static_cast<double>(out.all[t].label_probability));
  }
  return result;
}

// How often the frame's label is right, and how many frames after a segment's start (all but the
// first) the stream reports it with a probability above 0.8.
class LabelScore {
 public:
  void add(const Followed& hand, const gesture::Recording& truth, int lag) {
    for (std::size_t i = 0; i < truth.segments.size(); ++i) {
      const gesture::Segment& segment = truth.segments[i];
      int reported = segment.end - segment.begin;
      for (int t = segment.begin; t < segment.end; ++t) {
        const auto at = static_cast<std::size_t>(t);
        const bool right = hand.label[at] == segment.label;
        ++frames_;
        hits_ += right ? 1 : 0;
        if (right && hand.probability[at] > 0.8) reported = std::min(reported, t - segment.begin);
      }
      if (i > 0) delays_.push_back(reported + lag);
    }
  }
  [[nodiscard]] double accuracy() const { return static_cast<double>(hits_) / frames_; }
  [[nodiscard]] int median_delay() {
    std::ranges::sort(delays_);
    return delays_[delays_.size() / 2];
  }

 private:
  int frames_ = 0, hits_ = 0;
  std::vector<int> delays_;
};

}  // namespace posed::test
