#include "drivers/mocopi/decoder.hpp"

#include <algorithm>
#include <bitset>

#include "drivers/pose_values.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mocopi {

namespace {

std::unexpected<Error> wrong_tree(const std::string& what) {
  return fail("the skeleton that the mocopi app sends " + what + "; start its sending again");
}

// Adds the bone and what hangs below it, depth first.
void add_bones(const std::vector<BoneEntry>& bones, const BoneEntry& bone, int parent,
               Skeleton& skeleton, MocopiLayout& layout) {
  const auto at = static_cast<int>(skeleton.joints.size());
  Joint& joint = skeleton.joints.emplace_back();
  joint.name = bone_name(bone.id);
  joint.parent = parent;
  joint.bone = canonical_bone(bone.id);
  if (parent >= 0) {
    const Vec3f& offset_m = bone.transform.position_m;
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
  }
  // The skeleton is sent as it stands in T-pose.
  const Eigen::Quaterniond local = to_eigen_double(bone.transform.rotation_xyzw);
  joint.T_world_joint = parent < 0 ? local : skeleton.joints[parent].T_world_joint * local;
  layout.id.push_back(bone.id);
  for (const BoneEntry& child : bones) {
    if (child.parent == bone.id && child.id != bone.id) {
      add_bones(bones, child, at, skeleton, layout);
    }
  }
}

}  // namespace

RT_SAFE std::size_t MocopiLayout::joint_of(std::uint16_t bone) const noexcept {
  return std::ranges::find(id, bone) - id.begin();
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  auto bones = TRY(parse_skeleton(description));
  const BoneEntry* root = nullptr;
  for (BoneEntry& bone : bones) {
    bool seen = false;
    const bool valid = is_plausible(bone.transform.position_m) &&
                       accept_rotation(bone.transform.rotation_xyzw, seen, 1e-2);
    if (!valid) return wrong_tree("puts bone " + std::to_string(bone.id) + " out of the room");
    const bool is_root = bone.parent == bone.id ||
                         std::ranges::find(bones, bone.parent, &BoneEntry::id) == bones.end();
    if (is_root && root != nullptr) return wrong_tree("has two roots");
    if (is_root) root = &bone;
  }
  if (root == nullptr) return wrong_tree("has no root");
  auto layout = std::make_unique<MocopiLayout>();
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = "mocopi";
  add_bones(bones, *root, -1, *skeleton, *layout);
  // Bones that are their own ancestors hang below no root.
  if (skeleton->joints.size() != bones.size()) return wrong_tree("has bones in a circle");
  TRY(skeleton->finish());
  layout->bodies.push_back({.name = "mocopi", .skeleton = std::move(skeleton)});
  return layout;
}

namespace {

constexpr double kLooseLength = 1e-2;  // of the squared length of a rotation

// Puts one bone of a frame in its place; false when it contradicts the layout.
RT_SAFE bool accept_bone(const BoneEntry& bone, const MocopiLayout& layout,
                         std::bitset<kMaxJoints>& taken, Frame& frame) noexcept {
  const std::size_t joint = layout.joint_of(bone.id);
  if (joint == layout.id.size() || taken[joint]) return false;
  taken.set(joint);
  Quatf rotation = bone.transform.rotation_xyzw;
  bool seen = false;
  if (!accept_rotation(rotation, seen, kLooseLength)) return false;
  if (!is_plausible(bone.transform.position_m)) return false;
  frame.rotation_xyzw[joint] = rotation;
  frame.valid[joint] = seen;
  if (joint == 0) frame.root_position_m = bone.transform.position_m;
  return true;
}

}  // namespace

RT_SAFE void MocopiDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                 Sink& sink) noexcept {
  Datagram datagram;
  Outcome outcome = decode_datagram(bytes, datagram);
  if (outcome == Outcome::kOk && datagram.kind == Kind::kSkeleton) {
    sink.description(datagram.content);
  } else if (outcome == Outcome::kOk) {
    outcome = accept_frame(datagram.content, sink);
  }
  sink.outcome(outcome);
}

RT_SAFE Outcome MocopiDecoder::accept_frame(std::span<const std::byte> content,
                                            Sink& sink) noexcept {
  FrameHead head;
  if (!read_frame(content, head)) return Outcome::kShort;
  if (layout_ == nullptr) return Outcome::kForeign;
  if (const Outcome order = order_.accept(head.number); order != Outcome::kOk) return order;
  // The frame number says what is new; a wall clock that was set back only stops the time.
  static_cast<void>(clock_.accept(head.unix_s));
  Frame frame;
  const Skeleton& skeleton = *layout_->bodies[0].skeleton;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) frame.rotation_xyzw[j] = kIdentity;
  frame.header.device_ns = clock_.device_ns();
  std::bitset<kMaxJoints> taken;
  FieldReader fields(head.bones);
  std::string_view name;
  std::span<const std::byte> value;
  while (fields.next(name, value)) {
    BoneEntry bone;
    if (name != "btdt") continue;
    if (!read_bone(value, false, bone)) return Outcome::kShort;
    if (!accept_bone(bone, *layout_, taken, frame)) return Outcome::kOutOfRange;
  }
  if (!fields.ok()) return Outcome::kShort;
  if (!taken[0]) return Outcome::kOutOfRange;  // nothing says where the body is
  sink.frame(0, frame);
  return Outcome::kOk;
}

}  // namespace posed::drivers::mocopi
