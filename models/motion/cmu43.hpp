// The 43 joint angles of Sato et al. (models/motion/README.md, References): which joints of the CMU
// Acclaim skeleton, which of their axes, and the axes' frames (the same in every CMU .asf). Root
// rotation 3, spine to head 18, arms 2 x (3 + 1), legs 2 x 7 (models/motion/README.md, "The 43
// joint angles").
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Geometry>

#include "models/motion/pose_space.hpp"

namespace posed::motion {

struct Cmu43Joint {
  const char* asf;    // name in an .asf / .amc
  const char* bvh;    // name in the BVH conversion whose zero pose is the Acclaim zero pose
  std::uint8_t axes;  // bit x = 1, y = 2, z = 4
  std::array<double, 3> axis_deg;  // of the .asf's `axis x y z XYZ` line
};

inline constexpr std::array<Cmu43Joint, kCmu43Joints> kCmu43{{
    {"root", "Hips", 7, {0, 0, 0}},
    {"lowerback", "LowerBack", 7, {0, 0, 0}},
    {"upperback", "Spine", 7, {0, 0, 0}},
    {"thorax", "Spine1", 7, {0, 0, 0}},
    {"lowerneck", "Neck", 7, {0, 0, 0}},
    {"upperneck", "Neck1", 7, {0, 0, 0}},
    {"head", "Head", 7, {0, 0, 0}},
    {"rhumerus", "RightArm", 7, {180, 30, 90}},
    {"rradius", "RightForeArm", 1, {180, 30, 90}},
    {"lhumerus", "LeftArm", 7, {180, -30, -90}},
    {"lradius", "LeftForeArm", 1, {180, -30, -90}},
    {"rfemur", "RightUpLeg", 7, {0, 0, -20}},
    {"rtibia", "RightLeg", 1, {0, 0, -20}},
    {"rfoot", "RightFoot", 5, {-90, 0, -20}},
    {"rtoes", "RightToeBase", 1, {-90, 0, -20}},
    {"lfemur", "LeftUpLeg", 7, {0, 0, 20}},
    {"ltibia", "LeftLeg", 1, {0, 0, 20}},
    {"lfoot", "LeftFoot", 5, {-90, 0, 20}},
    {"ltoes", "LeftToeBase", 1, {-90, 0, 20}},
}};

// C = Rz Ry Rx of the axis line.
[[nodiscard]] Eigen::Quaterniond cmu43_axis_frame(const Cmu43Joint& joint);

// The angles (x, y, z) [rad] of R = Rz Ry Rx, and back.
RT_SAFE [[nodiscard]] Eigen::Vector3d euler_xyz_rad(const Eigen::Quaterniond& rotation) noexcept;
[[nodiscard]] Eigen::Quaterniond rotation_from_euler_xyz(const Eigen::Vector3d& angle_rad) noexcept;

// The rotation vector, in the outer frame, of a small change of the Euler angles at `angle_rad`;
// the middle angle is limited to +-75 degrees, because near 90 degrees x and z turn about one axis
// and a difference of them has no meaning (models/motion/README.md, "Euler angles near the pole").
RT_SAFE [[nodiscard]] Eigen::Vector3d euler_change_as_vector(
    const Eigen::Vector3d& angle_rad, const Eigen::Vector3d& change_rad) noexcept;
inline constexpr double kMaxMiddleAngle_rad = 75.0 * 3.14159265358979323846 / 180.0;

}  // namespace posed::motion
