#include "models/hand/contacts.hpp"

#include <algorithm>

#include "models/hand/segments.hpp"

namespace posed::hand {
namespace {

constexpr double kCrossed_m = 1e-9;  // centre lines closer than this have no direction between them

// The direction that separates the pair.
RT_SAFE Eigen::Vector3d direction_apart(const HandPose& pose, BonePair pair,
                                        const Eigen::Vector3d& apart) noexcept {
  const double distance_m = apart.norm();
  if (distance_m > kCrossed_m) return apart / distance_m;
  const Eigen::Vector3d across =
      (pose.to_m[pair.a] - pose.from_m[pair.a]).cross(pose.to_m[pair.b] - pose.from_m[pair.b]);
  const double sine = across.norm();
  return sine > 1e-12 ? Eigen::Vector3d(across / sine) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
}

// d(point)/d(angle) = axis x (point - joint) for the angles of the joints before the point.
RT_SAFE void add_slope(const HandPose& pose, int bone, const Eigen::Vector3d& point_m,
                       const Eigen::Vector3d& direction,
                       std::array<double, kFingerChannels>& slope) noexcept {
  const int finger = bone / kFingerJoints;
  for (int joint = finger * kFingerJoints; joint <= bone; ++joint) {
    const Eigen::Vector3d lever = (point_m - pose.from_m[joint]).cross(direction);
    for (int axis = 0; axis < 3; ++axis) {
      const int channel = 3 * joint + axis;
      slope[channel - finger * kFingerChannels] = pose.axis[channel].dot(lever);
    }
  }
}

}  // namespace

void find_gaps(const HandGeometry& geometry, const HandPose& pose, double far_m, Gaps& gaps_m,
               Fingers moved) noexcept {
  std::array<Eigen::Vector3d, kHandJoints> middle_m;
  std::array<double, kHandJoints> reach_m{};
  std::array<double, kHandJoints> radius_m{};
  for (int b = 0; b < kHandJoints; ++b) {
    const FingerGeometry& finger = geometry.fingers[b / kFingerJoints];
    middle_m[b] = 0.5 * (pose.from_m[b] + pose.to_m[b]);
    radius_m[b] = finger.radius_m[b % kFingerJoints];
    reach_m[b] = 0.5 * finger.length_m[b % kFingerJoints] + radius_m[b];
  }
  for (std::size_t p = 0; p < kPairs.size(); ++p) {
    const auto [a, b] = kPairs[p];
    if (!moved[a / kFingerJoints] && !moved[b / kFingerJoints]) continue;
    const double near_m = reach_m[a] + reach_m[b] + far_m;
    if ((middle_m[a] - middle_m[b]).squaredNorm() > near_m * near_m) {
      gaps_m[p] = far_m;
      continue;
    }
    const Closest closest =
        closest_points(pose.from_m[a], pose.to_m[a], pose.from_m[b], pose.to_m[b]);
    gaps_m[p] = closest.apart.norm() - radius_m[a] - radius_m[b];
  }
}

double smallest(const Gaps& gaps_m) noexcept { return *std::ranges::min_element(gaps_m); }

GapSlope slope_of(const HandPose& pose, BonePair pair) noexcept {
  const Closest closest = closest_points(pose.from_m[pair.a], pose.to_m[pair.a],
                                         pose.from_m[pair.b], pose.to_m[pair.b]);
  const Eigen::Vector3d direction = direction_apart(pose, pair, closest.apart);
  const auto on = [&pose](int bone, double share) {
    return Eigen::Vector3d(pose.from_m[bone] + share * (pose.to_m[bone] - pose.from_m[bone]));
  };
  GapSlope slope;
  add_slope(pose, pair.a, on(pair.a, closest.s), direction, slope.a);
  add_slope(pose, pair.b, on(pair.b, closest.t), -direction, slope.b);
  return slope;
}

}  // namespace posed::hand
