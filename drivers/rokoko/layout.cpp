#include "drivers/rokoko/layout.hpp"

#include <algorithm>

#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::rokoko {
namespace {

// The body's own name; Studio lets two props, or a prop and an actor, have the same.
std::string body_name(const BodyKey& key, const std::vector<Body>& before) {
  std::string name = key.name.empty() ? "unnamed" : clean(key.name.text());
  if (key.part == Part::kLeftHand) name += " left hand";
  if (key.part == Part::kRightHand) name += " right hand";
  const auto is_used = [&before](const std::string& wanted) {
    return std::ranges::find(before, wanted, &Body::name) != before.end();
  };
  if (!is_used(name)) return name;
  for (int number = 2;; ++number) {
    const std::string numbered = name + ' ' + std::to_string(number);
    if (!is_used(numbered)) return numbered;
  }
}

SampleLayout face_samples() {
  SampleLayout samples;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    samples.names.emplace_back(face_value_name(i));
    samples.units.emplace_back("1");
  }
  return samples;
}

}  // namespace

Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                    const std::string& name) {
  if (body.joints.none()) return nullptr;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = name;
  std::array<int, kStudioJoints> place{};
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    place[j] = static_cast<int>(skeleton->joints.size());
    Joint& joint = skeleton->joints.emplace_back();
    if (body.key.part == Part::kProp) {
      joint.name = "prop";
      continue;
    }
    const int parent = parent_among(body.joints, j);
    const Vec3f& offset_m = body.offset_m[j];
    joint.name = studio_joint(j).name;
    joint.parent = parent < 0 ? -1 : place[static_cast<std::size_t>(parent)];
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
    joint.bone = studio_joint(j).bone;
    joint.T_world_joint = to_eigen_double(t_pose_rotation(j));
  }
  if (auto ok = skeleton->finish(); !ok) return std::unexpected(ok.error());
  return skeleton;
}

// RT-safe.
std::size_t StudioLayout::body_of(const BodyKey& key) const noexcept {
  return static_cast<std::size_t>(std::ranges::find(plans, key, &BodyPlan::key) - plans.begin());
}

Result<std::unique_ptr<const SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto described = parse_description(description);
  if (!described) return std::unexpected(described.error());
  auto layout = std::make_unique<StudioLayout>();
  for (const DescribedBody& body : *described) {
    const std::string name = body_name(body.key, layout->bodies);
    auto skeleton = skeleton_of(body, name);
    if (!skeleton) return std::unexpected(skeleton.error());
    layout->bodies.push_back({.name = name,
                              .skeleton = std::move(*skeleton),
                              .samples = body.face ? face_samples() : SampleLayout{}});
    BodyPlan& plan = layout->plans.emplace_back();
    plan.key = body.key;
    plan.face = body.face;
    for (std::size_t j = 0; j < kStudioJoints; ++j) {
      if (body.joints[j]) plan.joint.push_back(static_cast<std::uint8_t>(j));
    }
  }
  return layout;
}

}  // namespace posed::drivers::rokoko
