// The figures of the emulated people: invented proportions, in T-pose.
#include <algorithm>

#include "drivers/mvn/emulator.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr std::array<Vec3f, kBodySegments> kTall{{
    {0.0F, 0.98F, 0.0F},    // pelvis
    {0.0F, 0.10F, -0.01F},  // L5
    {0.0F, 0.12F, 0.0F},    // L3
    {0.0F, 0.11F, 0.0F},    // T12
    {0.0F, 0.11F, 0.0F},    // T8
    {0.0F, 0.15F, 0.0F},    // neck
    {0.0F, 0.10F, 0.0F},    // head
    {-0.03F, 0.09F, 0.0F},  // right arm
    {-0.15F, 0.0F, 0.0F},  {-0.32F, 0.0F, 0.0F}, {-0.26F, 0.0F, 0.0F},
    {0.03F, 0.09F, 0.0F},  // left arm
    {0.15F, 0.0F, 0.0F},   {0.32F, 0.0F, 0.0F},  {0.26F, 0.0F, 0.0F},
    {-0.09F, 0.0F, 0.0F},  // right leg
    {0.0F, -0.45F, 0.0F},  {0.0F, -0.43F, 0.0F}, {0.0F, -0.08F, 0.18F},
    {0.09F, 0.0F, 0.0F},  // left leg
    {0.0F, -0.45F, 0.0F},  {0.0F, -0.43F, 0.0F}, {0.0F, -0.08F, 0.18F},
}};

// A left hand: the carpus, then the segments of each finger from the thumb on.
constexpr std::array<Vec3f, kHandSegments> kLeftHand{{
    {0.01F, 0.0F, 0.0F},    {0.02F, -0.01F, 0.03F}, {0.03F, 0.0F, 0.02F}, {0.03F, 0.0F, 0.0F},
    {0.02F, 0.0F, 0.02F},   {0.06F, 0.0F, 0.0F},    {0.04F, 0.0F, 0.0F},  {0.025F, 0.0F, 0.0F},
    {0.02F, 0.0F, 0.0F},    {0.06F, 0.0F, 0.0F},    {0.045F, 0.0F, 0.0F}, {0.03F, 0.0F, 0.0F},
    {0.02F, 0.0F, -0.015F}, {0.055F, 0.0F, 0.0F},   {0.04F, 0.0F, 0.0F},  {0.025F, 0.0F, 0.0F},
    {0.02F, 0.0F, -0.03F},  {0.05F, 0.0F, 0.0F},    {0.03F, 0.0F, 0.0F},  {0.02F, 0.0F, 0.0F},
}};

Character person(std::uint8_t id, std::string_view name, float scale) {
  Character character;
  character.id = id;
  character.name_bytes = static_cast<std::uint8_t>(name.size());
  std::ranges::copy(name, character.name.begin());
  for (std::size_t i = 0; i < kBodySegments; ++i) {
    for (std::size_t k = 0; k < 3; ++k) character.offset_m[i][k] = scale * kTall[i][k];
  }
  return character;
}

}  // namespace

Character emulated_walker() {
  Character walker = person(0, "Walker", 1.0F);
  walker.fingers = true;
  for (std::size_t i = 0; i < kHandSegments; ++i) {
    const auto& [x, y, z] = kLeftHand[i];
    walker.offset_m[kLeftFingers + i] = {x, y, z};
    walker.offset_m[kRightFingers + i] = {-x, y, z};
  }
  return walker;
}

Character emulated_waver() { return person(1, "Waver", 0.9F); }

}  // namespace posed::drivers::mvn
