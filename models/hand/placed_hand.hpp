// PlacedHand: a hand in its latest pose, and the gaps between its bones there. A solver moves some
// fingers a little and looks again, so fingers whose angles are the same as in the pose before, to
// the bit, keep their places, and pairs of two such fingers their gaps. One stream, one thread.
#pragma once

#include "models/hand/contacts.hpp"
#include "models/hand/geometry.hpp"

namespace posed::hand {

class PlacedHand {
 public:
  explicit PlacedHand(const HandGeometry& geometry) : geometry_(geometry) {}

  // Puts the hand into a pose; returns its smallest gap [m], at most 10 mm. RT-safe.
  double move_to(const HandAngles& angles) noexcept;

  [[nodiscard]] const HandGeometry& geometry() const noexcept { return geometry_; }
  [[nodiscard]] const HandPose& pose() const noexcept { return pose_; }
  // Exact below 10 mm.
  [[nodiscard]] const Gaps& gaps_m() const noexcept { return gaps_m_; }

 private:
  HandGeometry geometry_;
  HandAngles angles_{};
  HandPose pose_;
  Gaps gaps_m_{};
  double smallest_m_ = 0.0;
  bool is_placed_ = false;
};

}  // namespace posed::hand
