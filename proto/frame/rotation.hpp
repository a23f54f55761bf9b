// The rotation functions that posed needs: conversion between Frame's plain quaternions and Eigen,
// rotation vectors, twist angles, rotations about one axis and minimal rotations. All are pure
// functions, RT-safe, in float or double according to their argument.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"

namespace posed {

enum class Axis : std::uint8_t { kX, kY, kZ };

[[nodiscard]] inline Eigen::Quaternionf to_eigen(const Quatf& q) noexcept {
  return {q[3], q[0], q[1], q[2]};
}

// As to_eigen(), in double and normalised, because a float quaternion's length is off by up to
// 1e-7.
[[nodiscard]] inline Eigen::Quaterniond to_eigen_double(const Quatf& q) noexcept {
  return to_eigen(q).cast<double>().normalized();
}

template <typename T>
[[nodiscard]] Quatf from_eigen(const Eigen::Quaternion<T>& q) noexcept {
  return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
          static_cast<float>(q.w())};
}

// Rotation vector (axis times angle [rad]) of the shorter way round, |v| <= pi.
template <typename T>
[[nodiscard]] Eigen::Matrix<T, 3, 1> rotation_log(const Eigen::Quaternion<T>& q) noexcept {
  const T sign = q.w() < T(0) ? T(-1) : T(1);
  const Eigen::Matrix<T, 3, 1> v = q.vec() * sign;
  const T sine = v.norm();
  if (sine < T(1e-6)) return v * T(2);  // angle / sin(angle / 2) rounds to 2 here
  return v * (T(2) * std::atan2(sine, q.w() * sign) / sine);
}

template <typename T>
[[nodiscard]] Eigen::Quaternion<T> rotation_exp(const Eigen::Matrix<T, 3, 1>& v) noexcept {
  const T angle = v.norm();
  // sin(angle / 2) / angle; the series is exact to rounding for these small angles
  const T scale = angle < T(1e-3) ? T(0.5) - angle * angle / T(48) : std::sin(angle / T(2)) / angle;
  return {std::cos(angle / T(2)), v.x() * scale, v.y() * scale, v.z() * scale};
}

// Angle of the twist about the unit vector `axis`, in (-pi, pi].
template <typename T>
[[nodiscard]] T twist_angle_rad(const Eigen::Quaternion<T>& q,
                                const Eigen::Matrix<T, 3, 1>& axis) noexcept {
  const T half = std::atan2(q.vec().dot(axis), q.w());
  constexpr T kPi = std::numbers::pi_v<T>;
  if (half > kPi / T(2)) return T(2) * (half - kPi);
  if (half <= -kPi / T(2)) return T(2) * (half + kPi);
  return T(2) * half;
}

[[nodiscard]] inline Eigen::Vector3d unit(Axis axis) noexcept {
  return Eigen::Vector3d::Unit(static_cast<int>(axis));
}

// Rotation about one axis. In a product of them in listed order, the first factor is outermost.
[[nodiscard]] inline Eigen::Quaterniond axis_rotation(Axis axis, double angle_rad) noexcept {
  const Eigen::Vector3d v = unit(axis) * std::sin(angle_rad / 2);
  return {std::cos(angle_rad / 2), v.x(), v.y(), v.z()};
}

// The smallest rotation that turns `from` onto `to`; identity when either has zero length.
[[nodiscard]] Eigen::Quaterniond minimal_rotation(const Eigen::Vector3d& from,
                                                  const Eigen::Vector3d& to) noexcept;

// Angle between two rotations [rad], 0 to pi; accurate for small angles, unlike acos of the dot
// product.
[[nodiscard]] inline double angle_between_rad(const Eigen::Quaterniond& a,
                                              const Eigen::Quaterniond& b) noexcept {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

// `angle_rad` shifted by whole turns to within half a turn of `near_rad`.
[[nodiscard]] inline double unwrap_near(double angle_rad, double near_rad) noexcept {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return angle_rad - kTurn * std::round((angle_rad - near_rad) / kTurn);
}

}  // namespace posed
