#include "models/style/live/body_mask.hpp"

#include <algorithm>
#include <charconv>
#include <string>

#include "proto/text/clean.hpp"
#include "proto/text/named_numbers.hpp"

namespace posed::style {
namespace {

// In the order of BodyPart, then those that are two of them.
constexpr std::array<std::string_view, kBodyParts> kNames{"trunk",     "head",     "left-arm",
                                                          "right-arm", "left-leg", "right-leg"};
struct Pair {
  std::string_view name;
  BodyPart left, right;
};
constexpr std::array kPairs{Pair{"arms", BodyPart::kLeftArm, BodyPart::kRightArm},
                            Pair{"legs", BodyPart::kLeftLeg, BodyPart::kRightLeg}};

double& at(Mask& mask, BodyPart part) { return mask[static_cast<std::size_t>(part)]; }

BodyPart part_of_bone(Bone bone) {
  if (bone <= Bone::kUpperChest) return BodyPart::kTrunk;
  if (bone <= Bone::kHead) return BodyPart::kHead;
  if (bone <= Bone::kLeftHand) return BodyPart::kLeftArm;
  if (bone <= Bone::kRightHand) return BodyPart::kRightArm;
  if (bone <= Bone::kLeftToes) return BodyPart::kLeftLeg;
  if (bone <= Bone::kRightToes) return BodyPart::kRightLeg;
  return bone < Bone::kRightThumbMetacarpal ? BodyPart::kLeftArm : BodyPart::kRightArm;
}

// False if no part has this name.
bool set_part(Mask& mask, std::string_view name, double factor) {
  for (const Pair& pair : kPairs) {
    if (pair.name == name) at(mask, pair.left) = at(mask, pair.right) = factor;
    if (pair.name == name) return true;
  }
  const auto* const found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return false;
  mask[found - kNames.begin()] = factor;
  return true;
}

}  // namespace

Result<Mask> mask_of(std::string_view text) {
  const auto numbers = TRY(parse_named_numbers(text, "mask", 0.0, 1.0));
  Mask mask = whole_body();
  for (const NamedNumber& one : numbers) {
    if (set_part(mask, one.name, one.number)) continue;
    std::string known;
    for (const Pair& pair : kPairs) known += std::string(pair.name) + ", ";
    for (const std::string_view name : kNames) known += std::string(name) + ", ";
    return misuse("mask: the body has no part " + in_quotes(one.name) +
                  "; it has: " + known.substr(0, known.size() - 2));
  }
  return mask;
}

RT_SAFE void describe_mask(const Mask& mask, ShortText& text) noexcept {
  bool first = true;
  for (std::size_t p = 0; p < kBodyParts; ++p) {
    if (mask[p] == 1.0) continue;
    std::array<char, 32> number{};
    const auto end = std::to_chars(number.data(), number.data() + number.size(), mask[p],
                                   std::chars_format::general, 3)
                         .ptr;
    text.add(first ? "" : ",");
    text.add(kNames[p]);
    text.add("=");
    text.add({number.data(), end});
    first = false;
  }
  if (first) text.add("whole body");
}

BodyPart part_of_joint(const Skeleton& skeleton, int joint) {
  for (int j = joint; j >= 0; j = skeleton.joints[j].parent) {
    const auto bone = skeleton.joints[j].bone;
    if (bone) return part_of_bone(*bone);
  }
  return BodyPart::kTrunk;
}

std::vector<BodyPart> parts_of(const motion::PoseSpace& space, const motion::PoseSpaceSpec& spec) {
  std::vector<BodyPart> parts;
  parts.reserve(space.dims());
  for (int d = 0; d < space.dims(); ++d) {
    const int joint = space.skeleton_joint_of_dim(d);
    const auto bone = bone_from_name(spec.joints[static_cast<std::size_t>(space.joint_of_dim(d))]);
    parts.push_back(joint < 0 && bone ? part_of_bone(*bone)
                                      : part_of_joint(space.skeleton(), joint));
  }
  return parts;
}

std::vector<LoosePart> loose_parts_of(const motion::PoseSpace& space,
                                      const motion::PoseSpaceSpec& spec) {
  std::vector<LoosePart> loose;
  for (const BodyPart part : parts_of(space, spec)) {
    const auto d = static_cast<int>(loose.size());
    const int joint = space.skeleton_joint_of_dim(d);
    const auto is = [&](Bone bone) {
      return joint >= 0 && joint == space.skeleton().joint_of(bone);
    };
    if (part >= BodyPart::kLeftLeg || space.joint_of_dim(d) == spec.root) {
      loose.push_back(LoosePart::kNone);
    } else if (is(Bone::kLeftShoulder)) {
      loose.push_back(LoosePart::kLeftShoulder);
    } else if (is(Bone::kRightShoulder)) {
      loose.push_back(LoosePart::kRightShoulder);
    } else {
      loose.push_back(static_cast<LoosePart>(part));
    }
  }
  return loose;
}

RT_SAFE void BodyMask::move(double step) noexcept {
  for (std::size_t p = 0; p < kBodyParts; ++p) {
    now_[p] += std::clamp(target_[p] - now_[p], -step, step);
  }
}

}  // namespace posed::style
