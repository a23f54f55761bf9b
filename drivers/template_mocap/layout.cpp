#include "drivers/template_mocap/layout.hpp"

#include <algorithm>

namespace posed::drivers::mocap {

Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyEntry& body) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = body.name;
  for (const JointEntry& entry : body.joints) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = entry.name;
    joint.parent = entry.parent;
    joint.offset_m = {entry.offset_m[0], entry.offset_m[1], entry.offset_m[2]};
  }
  if (auto ok = skeleton->finish(); !ok) return std::unexpected(ok.error());
  return skeleton;
}

// RT-safe.
std::size_t MocapLayout::body_of(std::uint16_t wanted) const noexcept {
  return static_cast<std::size_t>(std::ranges::find(id, wanted) - id.begin());
}

Result<std::unique_ptr<const SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto entries = parse_description(description);
  if (!entries) return std::unexpected(entries.error());
  auto layout = std::make_unique<MocapLayout>();
  for (const BodyEntry& entry : *entries) {
    auto skeleton = skeleton_of(entry);
    if (!skeleton) return std::unexpected(skeleton.error());
    layout->bodies.push_back({.name = entry.name, .skeleton = std::move(*skeleton)});
    layout->id.push_back(entry.id);
  }
  return layout;
}

}  // namespace posed::drivers::mocap
