#include "drivers/natnet/layout.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <utility>

#include "drivers/natnet/axes.hpp"
#include "drivers/natnet/model_def.hpp"
#include "drivers/pose_values.hpp"
#include "proto/rig/live.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::natnet {

namespace {

constexpr std::array<std::pair<std::string_view, Bone>, 5> kMotiveMiddle{{{"Hip", Bone::kHips},
                                                                          {"Ab", Bone::kSpine},
                                                                          {"Chest", Bone::kChest},
                                                                          {"Neck", Bone::kNeck},
                                                                          {"Head", Bone::kHead}}};

// Limb names without the L/R prefix, with the left bone.
constexpr std::array<std::pair<std::string_view, Bone>, 8> kMotiveLimbs{
    {{"Shoulder", Bone::kLeftShoulder},
     {"UArm", Bone::kLeftUpperArm},
     {"FArm", Bone::kLeftLowerArm},
     {"Hand", Bone::kLeftHand},
     {"Thigh", Bone::kLeftUpperLeg},
     {"Shin", Bone::kLeftLowerLeg},
     {"Foot", Bone::kLeftFoot},
     {"Toe", Bone::kLeftToes}}};

// The first of three joints, numbered from 1.
constexpr std::array<std::pair<std::string_view, Bone>, 5> kMotiveFingers{
    {{"Thumb", Bone::kLeftThumbMetacarpal},
     {"Index", Bone::kLeftIndexProximal},
     {"Middle", Bone::kLeftMiddleProximal},
     {"Ring", Bone::kLeftRingProximal},
     {"Pinky", Bone::kLeftLittleProximal}}};

template <std::size_t N>
std::optional<Bone> find_in(const std::array<std::pair<std::string_view, Bone>, N>& table,
                            std::string_view name) {
  const auto at = std::ranges::find(table, name, &std::pair<std::string_view, Bone>::first);
  return at == table.end() ? std::nullopt : std::optional(at->second);
}

std::optional<Bone> left_bone(std::string_view part) {
  if (const auto limb = find_in(kMotiveLimbs, part)) return limb;
  if (part.empty() || part.back() < '1' || part.back() > '3') return std::nullopt;
  const auto finger = find_in(kMotiveFingers, part.substr(0, part.size() - 1));
  if (!finger) return std::nullopt;
  return static_cast<Bone>(static_cast<int>(*finger) + part.back() - '1');
}

}  // namespace

std::optional<Bone> motive_bone(std::string_view name) {
  if (const auto middle = find_in(kMotiveMiddle, name)) return middle;
  if (name.empty() || (name[0] != 'L' && name[0] != 'R')) return std::nullopt;
  const auto left = left_bone(name.substr(1));
  if (!left || name[0] == 'L') return left;
  return bone_from_name("right" + std::string(bone_name(*left).substr(4)));
}

namespace {

constexpr float kMaxNatNetRate_hz = 10'000.0F;

std::unexpected<Error> wrong(const BodyDef& body, const std::string& what) {
  return fail("the NatNet server's body " + in_quotes(body.name) + " " + what +
              "; change it in Motive, or stop streaming it");
}

// Other programs get names in messages that must be UTF-8.
std::string shown_name(const BodyDef& body) {
  if (!body.name.empty()) return clean(body.name);
  return (body.is_skeleton ? "skeleton " : "rigid body ") + std::to_string(body.id);
}

// "Emma_Hip" of the skeleton Emma is Hip.
std::string bone_name_of(const BodyDef& body, const BoneDef& bone) {
  std::string_view name = bone.name;
  if (name.size() > body.name.size() + 1 && name.starts_with(body.name) &&
      name[body.name.size()] == '_') {
    name.remove_prefix(body.name.size() + 1);
  }
  return name.empty() ? "bone " + std::to_string(bone.id) : clean(name);
}

// Adds the bone `at` and all below it: depth first, as skeletons need it.
void add_with_children(const BodyDef& body, std::size_t at, std::vector<std::size_t>& order) {
  order.push_back(at);
  for (std::size_t child = 0; child < body.bones.size() && std::ssize(order) <= kMaxJoints;
       ++child) {
    if (child != at && body.bones[child].parent == body.bones[at].id) {
      add_with_children(body, child, order);
    }
  }
}

// The indices of the bones, parents first.
Result<std::vector<std::size_t>> order_of(const BodyDef& body) {
  const std::size_t count = body.bones.size();
  if (count == 0 || count > static_cast<std::size_t>(kMaxJoints)) {
    return wrong(body, "has " + std::to_string(count) + " bones instead of 1 to " +
                           std::to_string(kMaxJoints));
  }
  std::set<std::int32_t> ids;
  for (const BoneDef& bone : body.bones) {
    if (!ids.insert(bone.id).second) return wrong(body, "has two bones with the same number");
  }
  const auto is_first = [&](const BoneDef& bone) { return !ids.contains(bone.parent); };
  if (std::ranges::count_if(body.bones, is_first) != 1) {
    return wrong(body, "does not have exactly one bone without a parent");
  }
  std::vector<std::size_t> order;
  const auto first = std::ranges::find_if(body.bones, is_first);
  add_with_children(body, static_cast<std::size_t>(first - body.bones.begin()), order);
  if (order.size() != count) return wrong(body, "has bones that are each other's parents");
  return order;
}

// In T-pose all bones of Motive's skeletons have the rotation identity, whatever their names, so T
// stays identity. The recogniser knows the other conventions (FBX, BVH).
void name_joints(Skeleton& skeleton) {
  for (Joint& joint : skeleton.joints) {
    const auto bone = motive_bone(joint.name);
    if (bone && skeleton.joint_of(*bone) < 0) joint.bone = bone;
  }
  if (skeleton.joint_of(Bone::kHips) >= 0) return;
  const rig::Rig rig = rig::recognise(skeleton);
  for (std::size_t j = 0; j < rig.bone.size(); ++j) skeleton.joints[j].bone = rig.bone[j];
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyDef& body, bool z_up,
                                                    BodyTable& table) {
  const auto order = TRY(order_of(body));
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = shown_name(body);
  for (const std::size_t at : order) {
    const BoneDef& bone = body.bones[at];
    const Vec3f offset_m = from_motive(bone.offset_m, z_up);
    if (!is_plausible(offset_m)) {
      return wrong(body, "puts bone " + in_quotes(bone.name) + " out of the room");
    }
    Joint& joint = skeleton->joints.emplace_back();
    // A prop may have any name, and none of them makes it a person's bone.
    joint.name = body.is_skeleton ? bone_name_of(body, bone) : "rigid body";
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
    for (std::size_t j = 0; j < table.bone_ids.size(); ++j) {
      if (body.bones[order[j]].id == bone.parent) joint.parent = static_cast<int>(j);
    }
    table.bone_ids.push_back(static_cast<std::uint16_t>(bone.id));
    table.parents.push_back(joint.parent);
    table.offsets_m.push_back(offset_m);
  }
  if (body.is_skeleton) name_joints(*skeleton);
  if (auto ok = skeleton->finish(); !ok) return wrong(body, "is not usable: " + ok.error().message);
  return skeleton;
}

// Motive numbers the markers of a body from 1.
std::size_t marker_count(const BodyDef& body, const ModelDef& model) {
  std::size_t count = 0;
  for (const BoneDef& bone : body.bones) count += bone.markers;
  const auto set = model.markers.find(body.name);
  if (set != model.markers.end()) count = std::max(count, set->second);
  return std::min<std::size_t>(count, kMaxSampleValues / 3);
}

SampleLayout sample_layout_of(std::size_t markers) {
  SampleLayout layout;
  for (std::size_t number = 1; number <= markers; ++number) {
    for (const char axis : {'x', 'y', 'z'}) {
      layout.names.push_back("marker_" + std::to_string(number) + '_' + axis);
      layout.units.emplace_back("m");
    }
  }
  return layout;
}

Result<> add_body(const BodyDef& body, const ModelDef& model, const DescriptionHead& head,
                  NatNetLayout& layout) {
  if (layout.body_of(body.is_skeleton, body.id) < layout.bodies.size()) {
    return wrong(body, "has the number of another one, " + std::to_string(body.id));
  }
  BodyTable table{.id = body.id, .is_skeleton = body.is_skeleton};
  table.markers = marker_count(body, model);
  auto skeleton = TRY(skeleton_of(body, head.z_up, table));
  const bool has_rate = head.rate_hz > 0.0F && head.rate_hz <= kMaxNatNetRate_hz;
  layout.bodies.push_back({.name = shown_name(body),
                           .skeleton = std::move(skeleton),
                           .samples = sample_layout_of(table.markers),
                           .rate_hz = has_rate ? static_cast<double>(head.rate_hz) : 0.0,
                           .number = body.id});
  layout.tables.push_back(std::move(table));
  return {};
}

}  // namespace

RT_SAFE std::size_t BodyTable::joint_of(std::uint16_t bone_id, std::size_t guess) const noexcept {
  if (guess < bone_ids.size() && bone_ids[guess] == bone_id) return guess;
  return std::ranges::find(bone_ids, bone_id) - bone_ids.begin();
}

RT_SAFE std::size_t NatNetLayout::body_of(bool is_skeleton, std::int32_t id) const noexcept {
  const auto at = std::ranges::find_if(tables, [&](const BodyTable& table) noexcept {
    return table.is_skeleton == is_skeleton && table.id == id;
  });
  return at - tables.begin();
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  if (description.size() < kDescriptionHeadBytes) {
    return fail("the description of the NatNet server's bodies is cut; record the log again");
  }
  const DescriptionHead head = read_description_head(description);
  const auto model = TRY(parse_model_def(description.subspan(kDescriptionHeadBytes), head.version));
  if (model.bodies.size() > kMaxBodies) {
    return fail("the NatNet server streams " + std::to_string(model.bodies.size()) +
                " bodies, and posed follows at most " + std::to_string(kMaxBodies) +
                "; disable some in Motive");
  }
  auto layout = std::make_unique<NatNetLayout>();
  for (const BodyDef& body : model.bodies) {
    TRY(add_body(body, model, head, *layout));
  }
  return layout;
}

}  // namespace posed::drivers::natnet
