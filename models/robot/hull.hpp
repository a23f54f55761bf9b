// Convex shapes: all that is within a radius of the hull of a few corners; and the gap of two.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/rt_safe.hpp"

namespace posed::robot {

inline constexpr std::size_t kMaxHullCorners = 64;

struct Hull {
  std::vector<Eigen::Vector3d> corners;  // [m]; at least one
  double radius_m = 0.0;
};

// Holds all of `corners` (at least one) and little more, by at most kMaxHullCorners of its own.
// Cold.
Hull hull_of(std::span<const Eigen::Vector3d> corners);

// Moves the corners inwards and makes up for it by the radius, so that two hulls which overlap by
// less still have a gap, below zero, with a direction. Cold.
void round_off(Hull& hull);

struct PlacedHull {
  const Hull& hull;
  const Eigen::Matrix3d& turn;
  const Eigen::Vector3d& at_m;
};

struct Nearest {
  double gap_m = 0.0;
  Eigen::Vector3d at_a = Eigen::Vector3d::Zero(), at_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d apart = Eigen::Vector3d::UnitX();  // from b to a
};

// From `near_m` on the gap may be larger than it says, and there are no points. They lie on the
// corners' hulls; where those overlap, the gap is the radii's, and `apart` says nothing. Looks
// along `guess`, from b to a, first.
RT_SAFE [[nodiscard]] Nearest hull_gap(const PlacedHull& a, const PlacedHull& b,
                                       const Eigen::Vector3d& guess, double near_m) noexcept;

}  // namespace posed::robot
