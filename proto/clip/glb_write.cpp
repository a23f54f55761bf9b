#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "proto/clip/formats.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/frame/joint_channels.hpp"

namespace posed::clip {
namespace {

GltfNode end_site_of(const Joint& joint, int parent) {
  return {.name = joint.name + "_end", .parent = parent, .offset_m = *joint.end_site_m};
}

std::span<const double> values_of(const Clip& clip, int frame) {
  const auto row = clip.channels.row(frame);
  return {row.data(), static_cast<std::size_t>(row.size())};
}

}  // namespace

Result<> write_glb(const Clip& clip, const std::filesystem::path& path) {
  auto time_s = gltf_times(clip);
  if (!time_s) return std::unexpected(time_s.error());
  const Skeleton& skeleton = *clip.skeleton;
  GltfMotion motion{.name = path.stem().string(), .time_s = std::move(*time_s), .nodes = {}};
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const Joint& joint = skeleton.joints[j];
    GltfNode node{.name = joint.name, .parent = joint.parent, .offset_m = joint.offset_m};
    node.bone = joint.bone;
    const auto channels = channels_of(skeleton, j);
    const auto first = channels.data() - skeleton.channels.data();
    const bool moves = std::ranges::any_of(channels, &Channel::translation);
    const bool turns = !std::ranges::all_of(channels, &Channel::translation);
    for (int i = 0; i < clip.frames(); ++i) {
      const auto values = values_of(clip, i);
      if (moves) add_position(node, local_position(joint, channels, values.data() + first));
      if (turns) add_rotation(node, local_rotation(skeleton, j, values));
    }
    motion.nodes.push_back(std::move(node));
  }
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {  // behind all joints, to keep their order
    if (skeleton.joints[j].end_site_m) {
      motion.nodes.push_back(end_site_of(skeleton.joints[j], j));
    }
  }
  return write_gltf(motion, GltfKind::kSkin, path);
}

Format glb_format() { return {.name = "GLB", .extensions = {".glb"}, .write = write_glb}; }

}  // namespace posed::clip
