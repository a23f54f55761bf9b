#include "drivers/mvn/figure.hpp"

#include <algorithm>

#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {
namespace {

// Invented proportions, in T-pose.
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

}  // namespace

void set_name(Character& character, std::string_view name) {
  name = name.substr(0, kMvnNameBytes);
  character.name_bytes = static_cast<std::uint8_t>(name.size());
  std::ranges::copy(name, character.name.begin());
}

Character average_character(std::uint8_t id, std::string_view name, float scale, bool fingers) {
  Character character;
  character.id = id;
  character.fingers = fingers;
  set_name(character, name);
  for (std::size_t i = 0; i < kBodySegments; ++i) character.offset_m[i] = kTall[i];
  for (std::size_t i = 0; fingers && i < kHandSegments; ++i) {
    const auto& [x, y, z] = kLeftHand[i];
    character.offset_m[kLeftFingers + i] = {x, y, z};
    character.offset_m[kRightFingers + i] = {-x, y, z};
  }
  for (Vec3f& offset_m : character.offset_m) {
    for (float& x_m : offset_m) x_m *= scale;
  }
  return character;
}

CharacterPose pose_of(const Character& character, const Vec3f& root_m, const Rotations& rotations,
                      bool local) {
  CharacterPose pose;
  pose.fingers = character.fingers;
  pose.local = local;
  std::array<Eigen::Quaterniond, kSegments> global;
  for (std::size_t i = 0; i < character.segments(); ++i) {
    SegmentPose& segment = pose.segments[i];
    const int parent = parent_segment(i);
    const Quatf& q = rotations[i];
    segment.seen = q != Quatf{};
    const Eigen::Quaterniond turn =
        segment.seen ? to_eigen_double(q) : Eigen::Quaterniond::Identity();
    segment.position_m = parent < 0 ? root_m : character.offset_m[i];
    segment.rotation_xyzw = from_eigen(turn);
    global[i] = turn;
    if (parent < 0 || local) continue;
    const std::size_t above = parent;
    global[i] = global[above] * turn;  // of unit length, as both are
    segment.rotation_xyzw = from_eigen(global[i]);
    const Vec3f& o = character.offset_m[i];
    const Eigen::Vector3d offset = global[above] * Eigen::Vector3d(o[0], o[1], o[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      segment.position_m[k] =
          pose.segments[above].position_m[k] + static_cast<float>(offset[static_cast<int>(k)]);
    }
  }
  return pose;
}

std::array<Vec3f, kBodySegments> t_pose_of(const Character& character) {
  Rotations straight;
  straight.fill(kIdentity);
  const CharacterPose pose = pose_of(character, character.offset_m[0], straight, false);
  std::array<Vec3f, kBodySegments> position_m{};
  for (std::size_t i = 0; i < kBodySegments; ++i) position_m[i] = pose.segments[i].position_m;
  return position_m;
}

}  // namespace posed::drivers::mvn
