// Passes motions of a body through the live smoother with a gesture model, as a device would send
// them; shared by tests on synthetic bodies and on recordings.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/body_recording.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/smoothed.hpp"

namespace posed::test {

struct FollowedBody {
  Motion channels;  // [frames x channels of the model] deg
  std::vector<std::string> label;
  std::vector<double> probability;
  std::vector<Frame> frames;
};

// `measured` [frames x channels of the vocabulary] deg, NaN where a joint is missing, on the figure
// of `body`, whose first frame has all else.
inline FollowedBody followed_body(const gesture::Vocabulary& vocabulary, const clip::Clip& body,
                                  const Motion& measured, double rate_hz,
                                  const smooth::LiveOptions& options,
                                  const smooth::LiveModel* model) {
  const auto channels = gesture::PoseChannels::bind(vocabulary, *body.skeleton).value();
  smooth::LiveSmoother smoother(*body.skeleton, options, model);
  Frames out;
  const Frame first = body.frame(0);
  const auto count = static_cast<std::size_t>(channels.count());
  std::vector<double> q(count);
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    Frame frame = first;
    for (std::size_t c = 0; c < count; ++c) {
      q[c] = measured(t, static_cast<Eigen::Index>(c)) * kDegree;
      if (std::isfinite(q[c])) continue;
      const int joint = channels.joint_of(static_cast<int>(c));
      frame.valid[static_cast<std::size_t>(joint)] = false;
    }
    channels.write(q, 0.0, frame);
    frame.header.sequence = static_cast<std::uint64_t>(t + 1);
    frame.header.device_ns = nanoseconds(static_cast<double>(t) / rate_hz);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  FollowedBody result{.channels = Motion(measured.rows(), measured.cols()),
                      .label = {},
                      .probability = {},
                      .frames = std::move(out.all)};
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    const Frame& frame = result.frames[static_cast<std::size_t>(t)];
    channels.read(frame, 0.0, q);
    for (std::size_t c = 0; c < count; ++c) {
      result.channels(t, static_cast<Eigen::Index>(c)) = q[c] / kDegree;
    }
    result.label.emplace_back(frame.label.data());
    result.probability.push_back(static_cast<double>(frame.label_probability));
  }
  return result;
}

// Frames that carry the right label from `after_s` after the beginning of a segment on.
class FrameScore {
 public:
  void add(const std::vector<std::string>& label, const gesture::Recording& truth, double after_s) {
    for (const gesture::Segment& segment : truth.segments) {
      const int from = segment.begin + static_cast<int>(std::ceil(after_s * truth.rate_hz));
      for (int t = from; t < segment.end; ++t) {
        ++frames_;
        right_ += label[static_cast<std::size_t>(t)] == segment.label ? 1 : 0;
      }
    }
  }
  [[nodiscard]] double share() const { return static_cast<double>(right_) / frames_; }
  [[nodiscard]] int frames() const { return frames_; }

 private:
  int frames_ = 0, right_ = 0;
};

}  // namespace posed::test
