#include "models/hand/placed_hand.hpp"

#include <algorithm>

namespace posed::hand {
namespace {

constexpr double kFar_m = 10e-3;  // gaps above this are not computed

}  // namespace

double PlacedHand::move_to(const HandAngles& angles) noexcept {
  Fingers moved = kAllFingers;
  for (int f = 0; is_placed_ && f < kFingers; ++f) {
    const auto first = angles.begin() + kFingerChannels * f;
    moved[f] = !std::equal(first, first + kFingerChannels, angles_.begin() + kFingerChannels * f);
  }
  if (moved.none()) return smallest_m_;
  for (int f = 0; f < kFingers; ++f) {
    if (moved[f]) place_finger(geometry_, f, angles, pose_);
  }
  find_gaps(geometry_, pose_, kFar_m, gaps_m_, moved);
  angles_ = angles;
  is_placed_ = true;
  smallest_m_ = smallest(gaps_m_);
  return smallest_m_;
}

}  // namespace posed::hand
