#include "models/style/train/walk_only.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "models/motion/pose_space.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSwingWindow_s = 1.5;  // that a stride's swing is of
constexpr double kStriding = 0.95;      // quantile of the swings that counts as that of a stride
constexpr double kMinSwing_rad = 6.0 * kDegree;
constexpr double kStands = 0.4;       // of the swing of a stride: a window with less stands
constexpr double kStandsStill = 0.3;  // of it: who stands moves the legs by no more in all
constexpr double kWorthIt_s = 0.5;    // of standing, at one end
constexpr double kMargin_s = 0.1;  // of it stays, because the first step takes as long to be seen

// The frames at the begin in which the legs stand, where `stride_rad` is the rms of their strides.
Eigen::Index standing_first(const VectorXd& leg, const std::vector<double>& swings,
                            double stride_rad) {
  Eigen::Index first = 0;
  while (first < std::ssize(swings) &&
         swings[static_cast<std::size_t>(first)] < kStands * stride_rad) {
    ++first;
  }
  // That window still begins with standing.
  double least = leg[first], most = leg[first];
  while (first < leg.size() && most - least <= kStandsStill * stride_rad) {
    least = std::min(least, leg[first]);
    most = std::max(most, leg[first]);
    ++first;
  }
  return first;
}

// Rms about the mean in each window that begins at a frame.
std::vector<double> swings_of(const VectorXd& leg, Eigen::Index window) {
  std::vector<double> swings;
  for (Eigen::Index t = 0; t + window <= leg.size(); ++t) {
    const auto part = leg.segment(t, window).array();
    swings.push_back(std::sqrt((part - part.mean()).square().mean()));
  }
  return swings;
}

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
std::vector<double> turned_rad(const motion::Motion& motion, const motion::PoseSpace& space) {
  std::vector<double> heading_rad;
  for (const Frame& frame : motion.frames) {
    const double measured_rad = space.heading_rad(frame);
    heading_rad.push_back(heading_rad.empty() ? measured_rad
                                              : unwrap_near(measured_rad, heading_rad.back()));
  }
  std::vector<double> turned = smooth(heading_rad, std::lround(kHalfWindow_s * motion.rate_hz));
  const double first_rad = turned.front();
  for (double& turn : turned) turn -= first_rad;
  return turned;
}

Vector3d root_m(const Frame& frame) {
  return Eigen::Map<const Eigen::Vector3f>(frame.root_position_m.data()).cast<double>();
}

}  // namespace

Standing leave_out_standing(motion::Motion& motion) {
  const auto leg = motion::leg_signal(motion);
  const auto window = std::max<Eigen::Index>(2, std::lround(kSwingWindow_s * motion.rate_hz));
  if (!leg || leg->size() < window) return {};
  std::vector<double> swings = swings_of(*leg, window);
  std::vector<double> sorted = swings;
  std::ranges::sort(sorted);
  const double stride_rad =
      sorted[static_cast<std::size_t>(kStriding * static_cast<double>(sorted.size() - 1))];
  if (stride_rad < kMinSwing_rad) return {};
  const auto end = static_cast<Eigen::Index>(kMargin_s * motion.rate_hz);
  const auto left_out = [&](Eigen::Index standing) {
    const bool worth_it = static_cast<double>(standing) >= kWorthIt_s * motion.rate_hz;
    return worth_it ? standing - end : 0;
  };
  const Eigen::Index before = left_out(standing_first(*leg, swings, stride_rad));
  std::ranges::reverse(swings);
  const Eigen::Index after = left_out(standing_first(leg->reverse(), swings, stride_rad));
  const Eigen::Index left = leg->size() - before - after;
  if (!has_stride(static_cast<int>(left), motion.rate_hz)) return {};
  motion.frames.erase(motion.frames.end() - after, motion.frames.end());
  motion.frames.erase(motion.frames.begin(), motion.frames.begin() + before);
  const auto seconds = [&](Eigen::Index frames) {
    return frames > 0 ? static_cast<double>(frames + end) / motion.rate_hz : 0.0;
  };
  return {.before_s = seconds(before), .after_s = seconds(after)};
}

double straighten(motion::Motion& motion) {
  const Skeleton& skeleton = *motion.skeleton;
  const auto spec = motion::describe_space(
      motion::is_person(skeleton) ? motion::Space::kHumanoid : motion::Space::kNative, skeleton);
  if (!spec || motion.size() < 2) return 0.0;
  const auto space = motion::PoseSpace::bind(*spec, skeleton);
  if (!space) return 0.0;
  const std::vector<double> turned = turned_rad(motion, *space);
  const auto [least, most] = std::ranges::minmax(turned);
  if (most - least < kStraight_rad) return 0.0;
  Vector3d before_m = root_m(motion.frames.front());
  Vector3d at_m = before_m;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    Frame& frame = motion.frames[i];
    const Quaterniond back = axis_rotation(Axis::kY, -turned[i]);
    const Vector3d now_m = root_m(frame);
    at_m += back * (now_m - std::exchange(before_m, now_m));
    Eigen::Map<Eigen::Vector3f>(frame.root_position_m.data()) = at_m.cast<float>();
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      if (skeleton.joints[j].parent >= 0) continue;
      frame.rotation_xyzw[j] = from_eigen(back * to_eigen_double(frame.rotation_xyzw[j]));
    }
  }
  return most - least;
}

}  // namespace posed::style
