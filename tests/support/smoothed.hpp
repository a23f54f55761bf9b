// Passes a motion through the live smoother frame by frame, as a device would send it.
#pragma once

#include <vector>

#include "models/smooth/live_smoother.hpp"
#include "tests/support/grasps.hpp"

namespace posed::test {

inline smooth::LiveOptions live_options(int lag, double noise_deg) {
  return {.lag = {.frames = lag}, .noise_rad = noise_deg * kDegree};
}

// A skeleton with `channels` rotation channels, three per joint; the last joint may have fewer.
inline Skeleton body_with_channels(int channels) {
  Skeleton skeleton;
  skeleton.name = "toy";
  for (int c = 0; c < channels; ++c) {
    const int joint = c / 3;
    if (c % 3 == 0) {
      Joint& added = skeleton.joints.emplace_back();
      added.name = "joint" + std::to_string(joint);
      added.parent = joint - 1;
    }
    skeleton.channels.push_back(
        {.joint = static_cast<std::uint16_t>(joint), .axis = static_cast<Axis>(2 - c % 3)});
  }
  return skeleton;
}

inline Frame frame_of(const Skeleton& skeleton, const Eigen::RowVectorXd& angles_deg,
                      std::uint64_t sequence, std::int64_t device_ns) {
  Frame frame;
  const Eigen::RowVectorXd angles_rad = angles_deg * kDegree;
  pose_from_channels(skeleton, {angles_rad.data(), static_cast<std::size_t>(angles_rad.size())},
                     frame);
  frame.header.sequence = sequence;
  frame.header.device_ns = device_ns;
  return frame;
}

class Frames final : public StageOut {
 public:
  void frame(const StageFrame& made) noexcept override {
    all.push_back(made.frame);
    variance_rad2.assign(made.variance_rad2.begin(), made.variance_rad2.end());
  }
  std::vector<Frame> all;
  std::vector<double> variance_rad2;  // of the last
};

// Row t is the estimate of frame t [deg]. A joint with a NaN channel counts as missing.
inline Motion smoothed(const Motion& measured, double rate_hz, const smooth::LiveOptions& options) {
  Skeleton skeleton = body_with_channels(static_cast<int>(measured.cols()));
  skeleton.finish().value();
  smooth::LiveSmoother smoother(skeleton, options);
  Frames out;
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    const Frame frame = frame_of(skeleton, measured.row(t), static_cast<std::uint64_t>(t + 1),
                                 nanoseconds(static_cast<double>(t) / rate_hz));
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  Motion result(measured.rows(), measured.cols());
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    for (Eigen::Index c = 0; c < measured.cols(); ++c) {
      result(static_cast<Eigen::Index>(t), c) =
          static_cast<double>(out.all[t].angle_rad[static_cast<std::size_t>(c)]) / kDegree;
    }
  }
  return result;
}

}  // namespace posed::test
