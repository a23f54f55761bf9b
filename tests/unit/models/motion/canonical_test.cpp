// The same motion in two formats has the same rotations on the canonical skeleton.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <numbers>

#include "models/motion/kinematics.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"

namespace posed::motion {
namespace {

constexpr double kMaxTurn_deg = 0.01;
constexpr double kMaxShift_m = 1e-4;

struct Pair {
  const char* bvh;
  const char* asf;
  bool dropped_above;  // the BVH omits the bone that leads to this joint
};
constexpr std::array<Pair, 31> kJointPairs{{{"Hips", "root", false},
                                            {"LHipJoint", "lhipjoint", false},
                                            {"LeftUpLeg", "lfemur", false},
                                            {"LeftLeg", "ltibia", false},
                                            {"LeftFoot", "lfoot", false},
                                            {"LeftToeBase", "ltoes", false},
                                            {"RHipJoint", "rhipjoint", false},
                                            {"RightUpLeg", "rfemur", false},
                                            {"RightLeg", "rtibia", false},
                                            {"RightFoot", "rfoot", false},
                                            {"RightToeBase", "rtoes", false},
                                            {"LowerBack", "lowerback", false},
                                            {"Spine", "upperback", false},
                                            {"Spine1", "thorax", false},
                                            {"Neck", "lowerneck", true},
                                            {"Neck1", "upperneck", false},
                                            {"Head", "head", false},
                                            {"LeftShoulder", "lclavicle", true},
                                            {"LeftArm", "lhumerus", false},
                                            {"LeftForeArm", "lradius", false},
                                            {"LeftHand", "lwrist", false},
                                            {"LeftFingerBase", "lhand", true},
                                            {"LeftHandIndex1", "lfingers", false},
                                            {"LThumb", "lthumb", true},
                                            {"RightShoulder", "rclavicle", true},
                                            {"RightArm", "rhumerus", false},
                                            {"RightForeArm", "rradius", false},
                                            {"RightHand", "rwrist", false},
                                            {"RightFingerBase", "rhand", true},
                                            {"RightHandIndex1", "rfingers", false},
                                            {"RThumb", "rthumb", true}}};

double degrees(double angle_rad) { return angle_rad * 180.0 / std::numbers::pi; }

Eigen::Quaterniond local(const Frame& frame, int joint) {
  return to_eigen_double(frame.rotation_xyzw[static_cast<std::size_t>(joint)]);
}

Eigen::Quaterniond t_of_parent(const Skeleton& skeleton, int joint) {
  const int parent = skeleton.joints[joint].parent;
  return parent < 0 ? Eigen::Quaterniond::Identity() : skeleton.joints[parent].T_world_joint;
}

// Lc = T_parent L T_joint^-1.
Eigen::Quaterniond canonical(const Skeleton& skeleton, const Frame& frame, int joint) {
  return t_of_parent(skeleton, joint) * local(frame, joint) *
         skeleton.joints[joint].T_world_joint.conjugate();
}

clip::Clip read(const std::filesystem::path& path) {
  auto clip = clip::read_clip(path);
  if (!clip) FAIL(clip.error().text());
  return std::move(*clip);
}

// The worst difference of canonical rotations over all bones of both skeletons.
double worst_canonical_deg(const Skeleton& a, const Frame& frame_a, const Skeleton& b,
                           const Frame& frame_b) {
  double worst = 0.0;
  for (int bone = 0; bone < kBones; ++bone) {
    const int joint_a = a.joint_of(static_cast<Bone>(bone));
    const int joint_b = b.joint_of(static_cast<Bone>(bone));
    if (joint_a < 0 && joint_b < 0) continue;
    REQUIRE(joint_a >= 0);
    REQUIRE(joint_b >= 0);
    worst = std::max(worst, degrees(angle_between_rad(canonical(a, frame_a, joint_a),
                                                      canonical(b, frame_b, joint_b))));
  }
  return worst;
}

}  // namespace

TEST_CASE("07_01 is the same motion as AMC and as BVH") {
  const auto amc_path = test::shared("data/cmu/07_01.amc");
  const auto bvh_path = test::shared("data/cmu/07_01.bvh");
  if (!amc_path || !bvh_path) {
    SKIP_WITHOUT_SHARED();
  }
  const clip::Clip amc = read(*amc_path);
  const clip::Clip bvh = read(*bvh_path);
  REQUIRE(bvh.frames() == amc.frames() + 1);  // an added T-pose in front
  const Skeleton& asf = *amc.skeleton;
  Skeleton restored = *bvh.skeleton;
  for (const Pair& pair : kJointPairs) {
    if (!pair.dropped_above) continue;
    Joint& joint = restored.joints[restored.joint_index(pair.bvh)];
    CHECK(joint.offset_m.norm() == 0.0);
    joint.offset_m = asf.joints[asf.joint_index(pair.asf)].offset_m;
  }
  double worst_turn_deg = 0.0;
  double worst_shift_m = 0.0;
  double worst_canonical = 0.0;
  for (int i = 0; i < amc.frames(); ++i) {
    const Frame a = amc.frame(i);
    const Frame b = bvh.frame(i + 1);
    const WorldPose world_a = world_pose(asf, a);
    const WorldPose world_b = world_pose(restored, b);
    for (const Pair& pair : kJointPairs) {
      const int joint_a = asf.joint_index(pair.asf);
      const int joint_b = restored.joint_index(pair.bvh);
      worst_turn_deg = std::max(worst_turn_deg,
                                degrees(angle_between_rad(local(a, joint_a), local(b, joint_b))));
      worst_shift_m = std::max(worst_shift_m,
                               (world_a.position_m[joint_a] - world_b.position_m[joint_b]).norm());
    }
    worst_canonical = std::max(worst_canonical, worst_canonical_deg(asf, a, *bvh.skeleton, b));
  }
  INFO("rotations " << worst_turn_deg << " deg, positions " << worst_shift_m * 1e3
                    << " mm, canonical " << worst_canonical << " deg");
  CHECK(worst_turn_deg <= kMaxTurn_deg);
  CHECK(worst_shift_m <= kMaxShift_m);
  CHECK(worst_canonical <= kMaxTurn_deg);
}

TEST_CASE("16_15 is the same motion as AMC and as BVH with another zero pose") {
  const auto amc_path = test::shared("data/cmu/16_15.amc");
  const auto bvh_path = test::shared("data/cmu/16_15.bvh");
  if (!amc_path || !bvh_path) {
    SKIP_WITHOUT_SHARED();
  }
  const clip::Clip amc = read(*amc_path);
  const clip::Clip bvh = read(*bvh_path);
  REQUIRE(bvh.frames() == amc.frames());
  const Skeleton& asf = *amc.skeleton;
  const Skeleton& other = *bvh.skeleton;
  const auto axis_frame = [&asf](int joint) {
    return joint < 0 ? Eigen::Quaterniond::Identity() : asf.joints[joint].channel_frame;
  };
  double worst_turn_deg = 0.0;
  double worst_shift_m = 0.0;
  double worst_canonical = 0.0;
  for (int i = 0; i < amc.frames(); i += 4) {  // the conversion interpolated the frames between
    const Frame a = amc.frame(i);
    const Frame b = bvh.frame(i);
    const WorldPose world_a = world_pose(asf, a);
    const WorldPose world_b = world_pose(other, b);
    for (int joint_b = 0; joint_b < std::ssize(other.joints); ++joint_b) {
      const int joint_a = asf.joint_index(other.joints[joint_b].name);
      REQUIRE(joint_a >= 0);
      // L_asf = C_parent L_bvh C_joint^-1
      const Eigen::Quaterniond turned = axis_frame(asf.joints[joint_a].parent) * local(b, joint_b) *
                                        axis_frame(joint_a).conjugate();
      worst_turn_deg =
          std::max(worst_turn_deg, degrees(angle_between_rad(local(a, joint_a), turned)));
      worst_shift_m = std::max(worst_shift_m,
                               (world_a.position_m[joint_a] - world_b.position_m[joint_b]).norm());
    }
    worst_canonical = std::max(worst_canonical, worst_canonical_deg(asf, a, other, b));
  }
  INFO("rotations " << worst_turn_deg << " deg, positions " << worst_shift_m * 1e3
                    << " mm, canonical " << worst_canonical << " deg");
  CHECK(worst_turn_deg <= kMaxTurn_deg);
  CHECK(worst_shift_m <= kMaxShift_m);
  CHECK(worst_canonical <= kMaxTurn_deg);
}

}  // namespace posed::motion
