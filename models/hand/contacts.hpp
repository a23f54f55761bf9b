// The gaps between bones of a hand, and how each angle changes them (models/hand/README.md, "Gaps
// and their slopes"). A pair is two bones of different fingers: 10 pairs of fingers with 9 pairs of
// bones each. Bones of one finger, and the palm, do not form pairs, because a fist presses them
// together and gloves overstate how far it closes.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "models/hand/geometry.hpp"

namespace posed::hand {

struct BonePair {
  std::uint8_t a = 0;
  std::uint8_t b = 0;
};
inline constexpr int kBonePairs = kFingers * (kFingers - 1) / 2 * kFingerJoints * kFingerJoints;

inline constexpr std::array<BonePair, kBonePairs> kPairs = [] {
  std::array<BonePair, kBonePairs> pairs{};
  std::size_t count = 0;
  for (int a = 0; a < kHandJoints; ++a) {
    for (int b = (a / kFingerJoints + 1) * kFingerJoints; b < kHandJoints; ++b) {
      pairs[count++] = {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)};
    }
  }
  return pairs;
}();

using Fingers = std::bitset<kFingers>;
inline constexpr Fingers kAllFingers{(1U << kFingers) - 1};

// [pair] distance of the capsules [m], below zero where they overlap; exact below `far_m`,
// otherwise some value of at least `far_m`. Pairs of which neither finger is in `moved` keep the
// value that they have. RT-safe.
using Gaps = std::array<double, kBonePairs>;
void find_gaps(const HandGeometry& geometry, const HandPose& pose, double far_m, Gaps& gaps_m,
               Fingers moved = kAllFingers) noexcept;

[[nodiscard]] double smallest(const Gaps& gaps_m) noexcept;

// How a pair's gap changes with the nine angles of either finger [m/rad]. RT-safe.
struct GapSlope {
  std::array<double, kFingerChannels> a{};
  std::array<double, kFingerChannels> b{};
};
[[nodiscard]] GapSlope slope_of(const HandPose& pose, BonePair pair) noexcept;

}  // namespace posed::hand
