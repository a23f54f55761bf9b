#include "models/motion/vrm_animation.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/retarget.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::motion {
namespace {

constexpr std::array kRequired{Bone::kHips,          Bone::kSpine,         Bone::kHead,
                               Bone::kLeftUpperArm,  Bone::kLeftLowerArm,  Bone::kLeftHand,
                               Bone::kRightUpperArm, Bone::kRightLowerArm, Bone::kRightHand,
                               Bone::kLeftUpperLeg,  Bone::kLeftLowerLeg,  Bone::kLeftFoot,
                               Bone::kRightUpperLeg, Bone::kRightLowerLeg, Bone::kRightFoot};

Result<> check_bones(const Skeleton& skeleton, const std::string& path) {
  std::string missing;
  for (const Bone bone : kRequired) {
    if (skeleton.joint_of(bone) >= 0) continue;
    add_word(missing, bone_name(bone));
  }
  if (missing.empty()) return {};
  return fail("skeleton " + in_quotes(skeleton.name) +
                  " lacks bones that a VRM figure must have: " + missing +
                  "; name its joints as VRM does, or write .glb, which takes any skeleton",
              path);
}

// VRM knows no figure without a spine, but those of pose estimators have only a neck above the
// hips: they get one that nothing turns, halfway up.
Result<std::shared_ptr<const Skeleton>> with_spine(std::shared_ptr<const Skeleton> humanoid) {
  const int neck = humanoid->joint_of(Bone::kNeck);
  if (humanoid->joint_of(Bone::kSpine) >= 0 || neck < 0 || humanoid->joints[neck].parent != 0) {
    return humanoid;
  }
  auto out = std::make_shared<Skeleton>(*humanoid);
  const Eigen::Vector3d half_m = out->joints[neck].offset_m / 2.0;
  for (Joint& joint : out->joints) {
    const bool above = joint.parent == 0 && joint.bone != Bone::kLeftUpperLeg &&
                       joint.bone != Bone::kRightUpperLeg;
    if (above) joint.offset_m -= half_m;
    if (joint.parent > 0 || above) ++joint.parent;
  }
  Joint spine;
  spine.name = bone_name(Bone::kSpine);
  spine.parent = 0;
  spine.bone = Bone::kSpine;
  spine.offset_m = half_m;
  out->joints.insert(out->joints.begin() + 1, std::move(spine));
  TRY(out->finish());
  return out;
}

// How high the hips of the T-pose are above its lowest point, so that the figure stands on the
// ground.
double hips_height_m(const Skeleton& humanoid) {
  double lowest_m = 0.0;
  std::vector<double> height_m;  // [joint], from the hips
  for (const Joint& joint : humanoid.joints) {
    height_m.push_back(joint.parent < 0 ? 0.0 : height_m[joint.parent] + joint.offset_m.y());
    lowest_m = std::min(lowest_m, height_m.back());
    if (joint.end_site_m) lowest_m = std::min(lowest_m, height_m.back() + joint.end_site_m->y());
  }
  return -lowest_m;
}

std::vector<clip::GltfNode> nodes_of(const Skeleton& humanoid) {
  std::vector<clip::GltfNode> nodes;
  for (const Joint& joint : humanoid.joints) {
    clip::GltfNode node{.name = joint.name, .parent = joint.parent, .offset_m = joint.offset_m};
    node.bone = joint.bone;
    nodes.push_back(std::move(node));
  }
  nodes.front().offset_m = {0.0, hips_height_m(humanoid), 0.0};
  return nodes;
}

}  // namespace

Result<> write_vrm_animation(const clip::Clip& clip, const std::filesystem::path& path) {
  auto time_s = TRY(clip::gltf_times(clip));
  if (clip.skeleton->joint_of(Bone::kHips) < 0) TRY(check_bones(*clip.skeleton, clip.path));
  auto humanoid = TRY(canonical_skeleton(*clip.skeleton));
  humanoid = TRY(with_spine(std::move(humanoid)));
  TRY(check_bones(*humanoid, clip.path));  // also of bones that hang beside the hips
  const auto retarget = TRY(Retarget::bind(clip.skeleton, humanoid));
  clip::GltfMotion motion{
      .name = path.stem().string(), .time_s = std::move(time_s), .nodes = nodes_of(*humanoid)};
  motion.timecode = clip.timecode;
  Frame pose;
  for (int i = 0; i < clip.frames(); ++i) {
    retarget.apply(clip.frame(i), pose);
    const auto& p = pose.root_position_m;
    clip::add_position(motion.nodes.front(), Eigen::Vector3f(p[0], p[1], p[2]).cast<double>());
    for (std::size_t j = 0; j < motion.nodes.size(); ++j) {
      clip::add_rotation(motion.nodes[j], to_eigen_double(pose.rotation_xyzw[j]));
    }
  }
  return clip::write_gltf(motion, clip::GltfKind::kVrmAnimation, path);
}

clip::Format vrm_animation_format() {
  return {.name = "VRM animation",
          .extensions = {".vrma"},
          .read = clip::read_gltf,
          .write = write_vrm_animation};
}

}  // namespace posed::motion
