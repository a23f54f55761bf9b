#include "models/hand/geometry.hpp"

#include <cmath>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::hand {
namespace {

RT_SAFE void place_bones(const FingerGeometry& finger, const double* angles,
                         Eigen::Vector3d* from_m, Eigen::Vector3d* to_m,
                         Eigen::Vector3d* axis) noexcept {
  Eigen::Matrix3d turned = finger.root;  // columns: the channels' axes in the wrist's frame
  Eigen::Vector3d at_m = finger.base_m;
  for (int j = 0; j < kFingerJoints; ++j) {
    const double* const q = angles + 3 * j;  // x, y, z
    const auto turn = [&turned](int u, int v, double angle_rad) {
      if (angle_rad == 0.0) return;  // half of the angles: most joints cannot spread or twist
      const double c = std::cos(angle_rad);
      const double s = std::sin(angle_rad);
      const Eigen::Vector3d before = turned.col(u);
      turned.col(u) = c * before + s * turned.col(v);
      turned.col(v) = c * turned.col(v) - s * before;
    };
    axis[3 * j + 2] = turned.col(2);
    turn(0, 1, q[2]);
    axis[3 * j] = turned.col(0);
    turn(1, 2, q[0]);
    axis[3 * j + 1] = turned.col(1);
    turn(2, 0, q[1]);
    if (j == 0) turned = turned * finger.bones;
    from_m[j] = at_m;
    at_m += turned * finger.along * finger.length_m[j];
    to_m[j] = at_m;
  }
}

}  // namespace

const HandShape& shape_of(const Skeleton& skeleton) {
  const auto shape = find_hand_shape(skeleton.name.substr(skeleton.name.rfind(' ') + 1));
  return shape ? **shape : default_hand_shape();
}

HandGeometry hand_geometry(const HandShape& shape) {
  HandGeometry geometry;
  for (int f = 0; f < kFingers; ++f) {
    const FingerShape& form = shape.fingers[f];
    const Eigen::Quaterniond root = channel_frame(Side::kRight, shape, f, 0);
    const Eigen::Quaterniond bones = channel_frame(Side::kRight, shape, f, 1);
    geometry.fingers[f] = {.base_m = form.base_m,
                           .root = root.toRotationMatrix(),
                           .bones = (root.conjugate() * bones).toRotationMatrix(),
                           .along = bones.conjugate() * form.frame * Eigen::Vector3d::UnitZ(),
                           .length_m = form.length_m,
                           .radius_m = form.radius_m};
    for (int c = 0; c < kFingerChannels; ++c) {
      const AngleRange& range = form.range[c / 3][c % 3];
      geometry.low_rad[kFingerChannels * f + c] = range.min_rad;
      geometry.high_rad[kFingerChannels * f + c] = range.max_rad;
    }
  }
  return geometry;
}

void place_finger(const HandGeometry& geometry, int finger, const HandAngles& angles,
                  HandPose& pose) noexcept {
  place_bones(geometry.fingers[finger], &angles[kFingerChannels * finger],
              &pose.from_m[kFingerJoints * finger], &pose.to_m[kFingerJoints * finger],
              &pose.axis[kFingerChannels * finger]);
}

void place(const HandGeometry& geometry, const HandAngles& angles, HandPose& pose) noexcept {
  for (int f = 0; f < kFingers; ++f) place_finger(geometry, f, angles, pose);
}

}  // namespace posed::hand
