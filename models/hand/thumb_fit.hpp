// Fits what a thumb's angles mean to poses in which it is known what the thumb touches
// (models/hand/README.md, "The thumb"). Angles of a glove's thumb say little by themselves: gloves
// have no common zero, and a few degrees at the root are centimetres at the tip. Cold.
#pragma once

#include <array>
#include <span>

#include "models/hand/contacts.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"

namespace posed::hand {

// The angles of a thumb that gloves measure, as indices in HandAngles.
inline constexpr std::array<std::size_t, 4> kThumbAngles{2, 1, 3, 6};  // roll, abduction, MCP, IP

// One measured pose: angles as the map has them before the fit [rad].
struct ThumbPose {
  HandAngles angles{};
  Fingers touched{};       // fingers that the thumb's last bone touches
  bool beside = false;     // it lies beside the index finger
  bool stretched = false;  // it points away from the hand
};

// angle = gain * angle before + offset, for each of kThumbAngles.
struct ThumbMap {
  std::array<double, kThumbAngles.size()> gain{1.0, 1.0, 1.0, 1.0};
  std::array<double, kThumbAngles.size()> offset_rad{};

  void apply(HandAngles& angles) const noexcept;
};

// Least squares with a prior on each parameter: contacts alone would leave gains that no joint has.
[[nodiscard]] ThumbMap fit_thumb(const HandShape& shape, std::span<const ThumbPose> poses);

// From the thumb's last two bones to a finger [m]; below zero they overlap.
[[nodiscard]] double thumb_gap_m(const HandGeometry& geometry, const HandAngles& angles,
                                 int finger);

}  // namespace posed::hand
