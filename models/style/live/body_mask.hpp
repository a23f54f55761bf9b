// How much of the style each part of the body gets: factors from 0 to 1, which glide to new values.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "models/motion/pose_space.hpp"
#include "proto/frame/result.hpp"
#include "proto/text/short_text.hpp"

namespace posed::style {

// By the canonical bones: head with the neck, arms from the shoulders to the fingers, legs from the
// upper legs to the toes, the trunk with the hips. A joint that is no bone belongs to the next bone
// above it, and without one to the trunk.
enum class BodyPart : std::uint8_t { kTrunk, kHead, kLeftArm, kRightArm, kLeftLeg, kRightLeg };
inline constexpr std::size_t kBodyParts = 6;

// What can do something else while the legs walk. A shoulder belongs to its arm and counts alone,
// too: hands that carry a tray leave it to the walk.
enum class LoosePart : std::uint8_t {
  kTrunk,
  kHead,
  kLeftArm,
  kRightArm,
  kLeftShoulder,
  kRightShoulder,
  kNone,  // hips and legs
};
inline constexpr std::size_t kLooseParts = 6;
static_assert(static_cast<int>(LoosePart::kRightArm) == static_cast<int>(BodyPart::kRightArm));
inline constexpr std::array kShoulders{LoosePart::kLeftShoulder, LoosePart::kRightShoulder};
[[nodiscard]] constexpr std::size_t index_of(LoosePart part) noexcept {
  return static_cast<std::size_t>(part);
}
// The arm of a shoulder; other parts as they are.
[[nodiscard]] constexpr LoosePart whole_part(LoosePart part) noexcept {
  if (part == LoosePart::kLeftShoulder) return LoosePart::kLeftArm;
  return part == LoosePart::kRightShoulder ? LoosePart::kRightArm : part;
}

using Mask = std::array<double, kBodyParts>;  // by BodyPart
[[nodiscard]] constexpr Mask whole_body() noexcept { return {1.0, 1.0, 1.0, 1.0, 1.0, 1.0}; }

// What people write: "arms=0.5,head=0"; a part that is not named has 1. "arms" and "legs" are both
// sides. The error lists the parts that there are. Cold.
Result<Mask> mask_of(std::string_view text);

// The parts that differ from 1, as text; "whole body" if none does.
RT_SAFE void describe_mask(const Mask& mask, ShortText& text) noexcept;

[[nodiscard]] BodyPart part_of_joint(const Skeleton& skeleton, int joint);
// The part of each dimension of q of a space bound from `spec`. Cold.
[[nodiscard]] std::vector<BodyPart> parts_of(const motion::PoseSpace& space,
                                             const motion::PoseSpaceSpec& spec);
// The same of its loose parts.
[[nodiscard]] std::vector<LoosePart> loose_parts_of(const motion::PoseSpace& space,
                                                    const motion::PoseSpaceSpec& spec);

// The factors of a live filter; each moves by at most `step` at once. RT-safe.
class BodyMask {
 public:
  void begin(const Mask& mask) noexcept { now_ = target_ = mask; }
  void aim(const Mask& mask) noexcept { target_ = mask; }
  void move(double step) noexcept;
  [[nodiscard]] float factor(BodyPart part) const noexcept {
    return static_cast<float>(now_[static_cast<std::size_t>(part)]);
  }
  [[nodiscard]] const Mask& now() const noexcept { return now_; }
  [[nodiscard]] const Mask& target() const noexcept { return target_; }

 private:
  Mask now_ = whole_body(), target_ = whole_body();
};

}  // namespace posed::style
