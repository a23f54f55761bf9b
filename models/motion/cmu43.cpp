#include "models/motion/cmu43.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::motion {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond cmu43_axis_frame(const Cmu43Joint& joint) {
  return rotation_from_euler_xyz(Vector3d(joint.axis_deg.data()) * kDegree);
}

RT_SAFE Vector3d euler_xyz_rad(const Quaterniond& rotation) noexcept {
  const Eigen::Matrix3d m = rotation.toRotationMatrix();
  return {std::atan2(m(2, 1), m(2, 2)), std::asin(std::clamp(-m(2, 0), -1.0, 1.0)),
          std::atan2(m(1, 0), m(0, 0))};
}

RT_SAFE Quaterniond rotation_from_euler_xyz(const Vector3d& angle_rad) noexcept {
  return axis_rotation(Axis::kZ, angle_rad.z()) * axis_rotation(Axis::kY, angle_rad.y()) *
         axis_rotation(Axis::kX, angle_rad.x());
}

RT_SAFE Vector3d euler_change_as_vector(const Vector3d& angle_rad,
                                        const Vector3d& change_rad) noexcept {
  const double y = std::clamp(angle_rad.y(), -kMaxMiddleAngle_rad, kMaxMiddleAngle_rad);
  const Quaterniond z_turn = axis_rotation(Axis::kZ, angle_rad.z());
  const Quaterniond zy_turn = z_turn * axis_rotation(Axis::kY, y);
  return zy_turn * Vector3d::UnitX() * change_rad.x() +
         z_turn * Vector3d::UnitY() * change_rad.y() + Vector3d::UnitZ() * change_rad.z();
}

}  // namespace posed::motion
