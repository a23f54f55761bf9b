// The segments of an MVN character: their order in a datagram, their tree, their names and which
// canonical bones they are. The specification numbers the segments; the tree is that of MVN's
// figure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::mvn {

inline constexpr std::size_t kBodySegments = 23;
inline constexpr std::size_t kHandSegments = 20;
inline constexpr std::size_t kSegments = kBodySegments + 2 * kHandSegments;

// The hands, of the body's segments: their fingers may follow.
inline constexpr std::size_t kRightHandSegment = 10;
inline constexpr std::size_t kLeftHandSegment = 14;
inline constexpr std::size_t kLeftFingers = kBodySegments;
inline constexpr std::size_t kRightFingers = kBodySegments + kHandSegments;

// The segment of each item of type 05.
inline constexpr std::array<std::uint8_t, kBodySegments> kUnitySegments{
    0, 15, 16, 17, 18, 19, 20, 21, 22, 1, 2, 3, 4, 11, 12, 13, 14, 7, 8, 9, 10, 5, 6};

// The parent of a segment; -1 for the pelvis.
RT_SAFE [[nodiscard]] constexpr int parent_segment(std::size_t segment) noexcept {
  constexpr std::array<int, kBodySegments> kParents{-1, 0,  1,  2, 3,  4,  5,  4, 7,  8,  9, 4,
                                                    11, 12, 13, 0, 15, 16, 17, 0, 19, 20, 21};
  if (segment < kBodySegments) return kParents[segment];
  const bool left = segment < kRightFingers;
  const std::size_t carpus = left ? kLeftFingers : kRightFingers;
  switch (segment - carpus) {
    case 0:
      return static_cast<int>(left ? kLeftHandSegment : kRightHandSegment);
    case 1:
    case 4:
    case 8:
    case 12:
    case 16:
      return static_cast<int>(carpus);
    default:
      return static_cast<int>(segment) - 1;
  }
}

// The joints of the skeleton that posed makes of a character, depth first.
struct JointTable {
  std::size_t count = 0;
  std::array<std::uint8_t, kSegments> segment{};  // [joint]
  std::array<int, kSegments> parent{};            // [joint], a joint; -1 for the first
};
RT_SAFE [[nodiscard]] const JointTable& joint_table(bool fingers) noexcept;

// "Pelvis", "L5", "LeftUpperArm", "LeftSecondMiddlePhalange". Cold.
[[nodiscard]] std::string segment_name(std::size_t segment);
// None for T12, the carpus and the metacarpals of four fingers. Cold.
[[nodiscard]] std::optional<Bone> segment_bone(std::size_t segment);

}  // namespace posed::drivers::mvn
