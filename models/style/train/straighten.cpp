#include "models/style/train/straighten.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "models/motion/pose_space.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStraight_rad = 30.0 * kDegree;
constexpr double kHalfWindow_s = 1.25;  // longer than a stride, whose sway stays

// The value at each place of a line through its neighbours, under Hann weights: without what swings
// faster than the window, and without lag, also at the ends.
std::vector<double> smooth(const std::vector<double>& values, std::ptrdiff_t half) {
  std::vector<double> smoothed(values.size());
  const auto size = std::ssize(values);
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    double w = 0.0, wx = 0.0, wxx = 0.0, wy = 0.0, wxy = 0.0;
    for (std::ptrdiff_t k = std::max(-i, -half); k <= std::min(size - 1 - i, half); ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(half + 1);
      const double weight = 0.5 + 0.5 * std::cos(std::numbers::pi * x);
      const double y = values[static_cast<std::size_t>(i + k)];
      w += weight;
      wx += weight * x;
      wxx += weight * x * x;
      wy += weight * y;
      wxy += weight * x * y;
    }
    const double spread = w * wxx - wx * wx;
    smoothed[static_cast<std::size_t>(i)] =
        spread > 1e-9 * w * w ? (wxx * wy - wx * wxy) / spread : wy / w;
  }
  return smoothed;
}

// How far the body has turned by each frame [rad], without jumps of a whole turn.
std::vector<double> turned_rad(const clip::Clip& clip, const motion::PoseSpace& space) {
  std::vector<double> heading_rad(static_cast<std::size_t>(clip.frames()));
  for (std::size_t i = 0; i < heading_rad.size(); ++i) {
    const double measured_rad = space.heading_rad(clip.frame(static_cast<int>(i)));
    heading_rad[i] = i == 0 ? measured_rad : unwrap_near(measured_rad, heading_rad[i - 1]);
  }
  std::vector<double> turned = smooth(heading_rad, std::lround(kHalfWindow_s * clip.frame_rate_hz));
  const double first_rad = turned.front();
  for (double& turn : turned) turn -= first_rad;
  return turned;
}

Vector3d root_m(const Frame& frame) {
  return Eigen::Map<const Eigen::Vector3f>(frame.root_position_m.data()).cast<double>();
}

}  // namespace

void straighten(clip::Clip& clip) {
  const bool is_person = motion::is_person(*clip.skeleton);
  const auto spec = motion::describe_space(
      is_person ? motion::Space::kHumanoid : motion::Space::kNative, *clip.skeleton);
  if (!spec || clip.frames() < 2) return;
  const auto space = motion::PoseSpace::bind(*spec, *clip.skeleton);
  if (!space) return;
  const std::vector<double> turned = turned_rad(clip, *space);
  const auto [least, most] = std::ranges::minmax(turned);
  if (most - least < kStraight_rad) return;
  clip::FramesClip straight(clip.skeleton);
  Vector3d before_m = root_m(clip.frame(0));
  Vector3d at_m = before_m;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    Frame frame = clip.frame(static_cast<int>(i));
    frame.angle_count = 0;  // the rotations count
    const Quaterniond back = axis_rotation(Axis::kY, -turned[i]);
    const Vector3d now_m = root_m(frame);
    at_m += back * (now_m - std::exchange(before_m, now_m));
    Eigen::Map<Eigen::Vector3f>(frame.root_position_m.data()) = at_m.cast<float>();
    for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
      if (clip.skeleton->joints[j].parent >= 0) continue;
      frame.rotation_xyzw[j] = from_eigen(back * to_eigen_double(frame.rotation_xyzw[j]));
    }
    straight.add(frame);
  }
  auto made = straight.finish(clip.path, clip.frame_rate_hz, clip.time_s);
  if (made && made->channels.cols() == clip.channels.cols()) {
    clip.channels = std::move(made->channels);
  }
}

}  // namespace posed::style
