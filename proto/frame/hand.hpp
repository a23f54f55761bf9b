// hand45: one hand as 45 angles, the pose of Takamido et al. (models/gesture/README.md,
// "References"). Five fingers from thumb to little, three joints each from the palm outwards, three
// angles a joint: x flexion (positive when closing), y spread, z twist. Spread is positive where
// the finger leaves the middle finger: index and thumb then go towards the thumb's side, ring and
// little towards the little finger's; the middle's own is positive towards the thumb. R = Rz(twist)
// Rx(flexion) Ry(spread), right hand palm down, fingers along +Z; a left hand is the mirror image
// with the same signs. Angles in radians.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace posed {

enum class Side : std::uint8_t { kLeft, kRight };

inline constexpr int kFingers = 5;
inline constexpr int kFingerJoints = 3;
inline constexpr int kHandJoints = kFingers * kFingerJoints;
inline constexpr int kFingerChannels = 3 * kFingerJoints;
inline constexpr int kHandChannels = kFingers * kFingerChannels;

inline constexpr std::array<std::string_view, kFingers> kFingerNames{"thumb", "index", "middle",
                                                                     "ring", "little"};

// [finger][joint][x, y, z] in one row, the order of the hand CSV's columns and of every gesture
// model.
using HandAngles = std::array<double, kHandChannels>;

}  // namespace posed
