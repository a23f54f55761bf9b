#include "daemon/output/avatar.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/vmc/bones.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::output {
namespace {

namespace vmc = drivers::vmc;

constexpr Bone wrist_of(Side side) noexcept {
  return side == Side::kLeft ? Bone::kLeftHand : Bone::kRightHand;
}
constexpr bool is_finger(Side side, Bone bone) noexcept {
  return bone >= hand_bone(side, 0) && bone <= hand_bone(side, kHandJoints - 1);
}
constexpr bool is_of_hand(Side side, Bone bone) noexcept {
  return bone == wrist_of(side) || is_finger(side, bone);
}

// Where the part begins.
constexpr Bone top_of(Part part) noexcept {
  if (part == Part::kBody) return Bone::kHips;
  return wrist_of(part == Part::kLeftHand ? Side::kLeft : Side::kRight);
}

std::optional<std::size_t> sent_bone(Bone bone) noexcept {
  const auto& table = vmc::bone_table();
  const auto found = std::ranges::find(table, std::optional(bone), &vmc::BoneEntry::bone);
  if (found == table.end()) return std::nullopt;
  return static_cast<std::size_t>(found - table.begin());
}

}  // namespace

// The wrist is the body's: a glove's own stream does not say how it is turned.
bool Avatar::writes(Part part, Bone bone) const noexcept {
  if (part == Part::kLeftHand) return is_finger(Side::kLeft, bone);
  if (part == Part::kRightHand) return is_finger(Side::kRight, bone);
  return !hands_only_ || is_of_hand(Side::kLeft, bone) || is_of_hand(Side::kRight, bone);
}

Result<> Avatar::set_skeleton(Part part, std::shared_ptr<const Skeleton> skeleton) {
  Source& source = sources_[index_of(part)];
  source = {};
  if (skeleton == nullptr) return {};
  auto canonical =
      TRY(motion::canonical_skeleton(figure_ == nullptr ? *skeleton : *figure_, top_of(part)));
  const std::string name = in_quotes(skeleton->name);
  auto bound = TRY(motion::Retarget::bind(std::move(skeleton), canonical));
  for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
    const Joint& joint = canonical->joints[j];
    const auto bone = sent_bone(*joint.bone);
    if (!bone || !writes(part, *joint.bone)) continue;
    const Eigen::Vector3f offset_m = joint.offset_m.cast<float>();
    source.moved.push_back(
        {.joint = j, .bone = *bone, .offset_m = {offset_m.x(), offset_m.y(), offset_m.z()}});
  }
  if (source.moved.empty()) {
    return fail("skeleton " + name + " has no bones of a " +
                (part == Part::kBody ? "hand" : std::string(words_for(part))));
  }
  source.to_canonical = std::move(bound);
  return {};
}

bool Avatar::set_pose(Part part, const Frame& frame) noexcept {
  Source& source = sources_[index_of(part)];
  if (!source.to_canonical) return false;
  source.to_canonical->apply(frame, source.pose);
  source.posed = true;
  return true;
}

void Avatar::write(vmc::DatagramWriter& writer) const noexcept {
  struct Chosen {
    const Source* source = nullptr;
    const Moved* moved = nullptr;
  };
  std::array<Chosen, vmc::kBoneCount> chosen{};
  for (const Source& source : sources_) {  // a hand after the body, so that it replaces its fingers
    if (!source.posed) continue;
    for (const Moved& moved : source.moved) chosen[moved.bone] = {&source, &moved};
  }
  if (chosen[vmc::kHips].source != nullptr) writer.root({}, kIdentity);
  for (std::size_t bone = 0; bone < vmc::kBoneCount; ++bone) {
    const auto [source, moved] = chosen[bone];
    if (source == nullptr) continue;
    writer.bone(bone, bone == vmc::kHips ? source->pose.root_position_m : moved->offset_m,
                source->pose.rotation_xyzw[moved->joint]);
  }
}

}  // namespace posed::output
