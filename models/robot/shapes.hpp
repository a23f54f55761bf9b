// The collision shapes of a robot as capsules that hold them, and the gaps between links.
#pragma once

#include <span>

#include "models/robot/robot_hand.hpp"

namespace posed::robot {

// In the frame of its link. Cold.
Hull hull_of_shape(const Shape& shape);

// Fills in capsules, hulls, covers, and which pairs of links can be kept apart. Where capsules
// touch when the hand is open, in most poses, or in many in which the hulls of the shapes do not,
// those are taken; of the former, the pairs that touch, too, are left out. Cold.
void add_shapes(RobotHand& hand);

// Two links and how their gap changes with each driven joint.
struct Gap {
  int a = 0, b = 0;
  double gap_m = 0.0;           // below zero: they overlap
  Drive slope = Drive::Zero();  // m/rad
};

inline constexpr int kMaxGaps = 32;
using Gaps = std::array<Gap, kMaxGaps>;

// Which pairs are wanted: those nearer than `most_m`; of these, where `turn` is given, only those
// that turning each joint by at most that [rad] can bring nearer than `least_m`.
struct Near {
  double most_m = 0.0, least_m = 0.0;
  const Drive* turn = nullptr;
};

// The nearest ones where there are more than fit. Without slopes for whoever does not need them.
RT_SAFE [[nodiscard]] std::span<const Gap> find_gaps(const RobotHand& hand, Placed& placed,
                                                     const Near& near, bool slopes,
                                                     Gaps& gaps) noexcept;

// The gap of one pair of links, infinite where one has no shape.
RT_SAFE [[nodiscard]] Gap gap_between(const RobotHand& hand, Placed& placed, int a, int b) noexcept;
// That of the shapes at two fingers' ends; where one has none, of balls of the tips' radii.
RT_SAFE [[nodiscard]] Gap gap_of_tips(const RobotHand& hand, Placed& placed, const Finger& a,
                                      const Finger& b) noexcept;
}  // namespace posed::robot
