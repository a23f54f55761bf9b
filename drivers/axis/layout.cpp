#include "drivers/axis/layout.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/text/clean.hpp"

namespace posed::drivers::axis {
namespace {

Eigen::Vector3d metres(const Vec3f& cm) {
  const Eigen::Vector3d v(static_cast<double>(cm[0]), static_cast<double>(cm[1]),
                          static_cast<double>(cm[2]));
  return v * kCentimetre_m;
}

void add_channels(Skeleton& skeleton, bool positions, std::uint8_t order) {
  const auto joint = static_cast<std::uint16_t>(skeleton.joints.size() - 1);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    if (!positions) break;
    skeleton.channels.push_back({.joint = joint, .axis = axis, .translation = true});
  }
  for (const Axis axis : order_axes(order)) {
    skeleton.channels.push_back({.joint = joint, .axis = axis});
  }
}

// Other programs get the names in messages that must be UTF-8. A name that another body has already
// differs by the avatar's number.
std::string body_name(const Avatar& avatar, const std::vector<Body>& bodies) {
  std::string name = clean(avatar.name_text());
  if (name.empty()) name = "avatar";
  while (std::ranges::find(bodies, name, &Body::name) != bodies.end()) {
    name += "-" + std::to_string(avatar.number);
  }
  return name;
}

}  // namespace

Result<std::shared_ptr<const Skeleton>> skeleton_of(const AvatarEntry& entry, std::uint8_t order) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = clean(entry.avatar.name_text());
  const int above = entry.reference ? 1 : 0;  // joints above the hips
  if (entry.reference) {
    skeleton->joints.emplace_back().name = "Reference";
    add_channels(*skeleton, true, order);
  }
  skeleton->root_joint = above;
  for (std::size_t b = 0; b < kBones; ++b) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = bone_name(b);
    joint.parent = b == kHips ? above - 1 : bone_parent(b) + above;
    joint.offset_m = metres(entry.offset_cm[b]);
    if (const Vec3f end_cm = bone_end_cm(b); end_cm != Vec3f{}) joint.end_site_m = metres(end_cm);
    add_channels(*skeleton, b == kHips, order);
  }
  if (auto ok = skeleton->finish(); !ok) return std::unexpected(ok.error());
  return skeleton;
}

// RT-safe.
std::size_t AxisLayout::body_of(const Avatar& avatar) const noexcept {
  return static_cast<std::size_t>(std::ranges::find(known, avatar, &Known::avatar) - known.begin());
}

Result<std::unique_ptr<const SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto list = parse_list(description);
  if (!list) return std::unexpected(list.error());
  auto layout = std::make_unique<AxisLayout>();
  for (const AvatarEntry& entry : list->avatars) {
    auto skeleton = skeleton_of(entry, list->order);
    if (!skeleton) return std::unexpected(skeleton.error());
    layout->bodies.push_back(
        {.name = body_name(entry.avatar, layout->bodies), .skeleton = std::move(*skeleton)});
    layout->known.push_back({.avatar = entry.avatar, .reference = entry.reference});
  }
  return layout;
}

}  // namespace posed::drivers::axis
