#include "drivers/vmc/layout.hpp"

#include <algorithm>
#include <set>

#include "proto/text/clean.hpp"

namespace posed::drivers::vmc {
namespace {

constexpr const char* kPerformer = "performer";

// The nearest parent that is sent; the hips are always there.
std::size_t parent_of(const Described& described, std::size_t bone) {
  int parent = bone_table()[bone].parent;
  while (parent > 0 && !described.bones[parent]) {
    parent = bone_table()[parent].parent;
  }
  return std::max(parent, 0);
}

// The height of the hips above the soles when the person stands straight.
double standing_m(const Described& described) {
  double height_m = 0.0;
  for (const char* name : {"LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "LeftToes"}) {
    height_m -= static_cast<double>(described.offset_m[find_bone(name)][1]);
  }
  return std::max(0.0, height_m);
}

Result<std::shared_ptr<const Skeleton>> make_skeleton(const Described& described,
                                                      VmcLayout& layout) {
  layout.hips_sent = described.bones[kHips];
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = described.title.empty() ? kPerformer : clean_name(described.title);
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (bone != kHips && !described.bones[bone]) continue;
    layout.joint_of[bone] = static_cast<int>(skeleton->joints.size());
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = bone_table()[bone].name;
    joint.bone = bone_table()[bone].bone;
    if (bone == kHips) {
      joint.offset_m = {0.0, standing_m(described), 0.0};
      continue;
    }
    joint.parent = layout.joint_of[parent_of(described, bone)];
    const Vec3f& offset_m = described.offset_m[bone];
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
  }
  TRY(skeleton->finish());
  return skeleton;
}

// Names and units of the sample values. Other programs get them in messages that must be UTF-8.
SampleLayout name_values(const Described& described, VmcLayout& layout) {
  constexpr std::array<const char*, kValueKinds> kPrefixes{"", "hmd/", "con/", "tra/"};
  SampleLayout samples;
  std::set<std::string, std::less<>> used;
  for (const Described::Value& value : std::span(described.values).first(described.value_count)) {
    std::string name = kPrefixes[static_cast<std::size_t>(value.kind)] + clean(value.name);
    if (!used.insert(name).second) continue;  // sent in two spellings that read the same
    layout.values.push_back({.kind = value.kind,
                             .name = std::string(value.name),
                             .place = static_cast<int>(samples.names.size())});
    if (value.kind == ValueKind::kBlend) {
      samples.names.push_back(std::move(name));
      samples.units.emplace_back("1");
      continue;
    }
    for (const char* axis : {"/x", "/y", "/z", "/qx", "/qy", "/qz", "/qw"}) {
      samples.names.push_back(name + axis);
      samples.units.emplace_back(axis[1] == 'q' ? "1" : "m");
    }
  }
  layout.value_count = samples.names.size();
  return samples;
}

}  // namespace

RT_SAFE int VmcLayout::place_of(ValueKind kind, std::string_view name) const noexcept {
  for (const Value& value : values) {
    if (value.kind == kind && value.name == name) return value.place;
  }
  return kNone;
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto described = TRY(parse_description(description));
  auto layout = std::make_unique<VmcLayout>();
  layout->joint_of.fill(VmcLayout::kNone);
  Body body{.name = kPerformer, .skeleton = nullptr};
  body.samples = name_values(described, *layout);
  if (described.bones.any()) {
    auto skeleton = TRY(make_skeleton(described, *layout));
    body.skeleton = std::move(skeleton);
  }
  if (body.skeleton != nullptr || layout->value_count > 0) {
    layout->bodies.push_back(std::move(body));
  }
  return layout;
}

}  // namespace posed::drivers::vmc
