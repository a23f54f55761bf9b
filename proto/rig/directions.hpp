// Small geometry of the recogniser: directions, angles in degrees, and rotations that lay one
// direction on another. Pure functions; every one is total, also for zero lengths.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/degree.hpp"

namespace posed::rig {

using Vec = Eigen::Vector3d;
using Mat = Eigen::Matrix3d;

inline const Vec kX = Vec::UnitX();
inline const Vec kY = Vec::UnitY();
inline const Vec kZ = Vec::UnitZ();

// +x, -x, +y, -y, +z, -z.
inline const std::array<Vec, 6> kAxes{kX, -kX, kY, -kY, kZ, -kZ};

// `v` with length 1; zero stays zero.
[[nodiscard]] inline Vec direction(const Vec& v) {
  const double length = v.norm();
  return length > 0.0 ? Vec(v / length) : v;
}

// `v` without its part along the unit vector `u`.
[[nodiscard]] inline Vec across(const Vec& v, const Vec& u) { return v - u * v.dot(u); }

[[nodiscard]] inline double angle_deg(const Vec& a, const Vec& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

// Angle of the rotation from `a` to `b`.
[[nodiscard]] inline double turn_deg(const Mat& a, const Mat& b) {
  return std::acos(std::clamp(((a.transpose() * b).trace() - 1.0) / 2.0, -1.0, 1.0)) / kDegree;
}

// The smallest rotation from direction `from` to direction `to`.
[[nodiscard]] Mat minimal(const Vec& from, const Vec& to);

// The rotation that turns `a` exactly onto `to_a`, and `b` as near as possible to `to_b`.
[[nodiscard]] Mat frame(const Vec& a, const Vec& to_a, const Vec& b, const Vec& to_b);

// The coordinate axis with the greatest part along `v`.
[[nodiscard]] Vec main_axis(const Vec& v);

// The coordinate axis nearest to `v`, if it lies within `limit_deg`.
[[nodiscard]] std::optional<Vec> nearest_axis(const Vec& v, double limit_deg);

// The four coordinate axes that lie across `v`.
[[nodiscard]] std::vector<Vec> axes_across(const Vec& v);

// The value below which `percent` of the values lie, interpolated; 0 without values.
[[nodiscard]] double percentile(std::vector<double> values, double percent);

}  // namespace posed::rig
