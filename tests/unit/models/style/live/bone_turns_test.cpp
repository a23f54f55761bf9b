// A style's change on a walker of another build: bones turn as those of training do, arms point
// where they are told to.
#include "models/style/live/bone_turns.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "models/motion/kinematics.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/synthetic_walker.hpp"

using namespace posed;
using Eigen::Vector3d;

namespace {

struct Build {
  clip::Clip walk =
      motion::make_walker({.family = motion::WalkerFamily::kMarch, .person = 1}).value();
  motion::PoseSpaceSpec spec =
      motion::describe_space(motion::Space::kHumanoid, *walk.skeleton).value();
  motion::PoseSpace space = motion::PoseSpace::bind(spec, *walk.skeleton).value();
  style::BoneTurns turns = style::BoneTurns::make(spec, {}, *walk.skeleton).value();
  std::size_t dims = static_cast<std::size_t>(space.dims());
  std::vector<float> all = std::vector<float>(dims, 1.0F);

  [[nodiscard]] std::vector<float> vector_of(const Frame& frame) const {
    std::vector<float> q(dims);
    std::vector<std::uint8_t> available(dims);
    space.to_vector(frame, 0.4, q, available);
    return q;
  }
  // For a training whose figure has its neck there and is as the walker's otherwise.
  [[nodiscard]] style::BoneTurns turns_of_taught_neck(double at, const Skeleton& skeleton) const {
    const auto places = style::trunk_places(*walk.skeleton);
    std::vector<double> taught;
    for (const std::string& name : spec.joints) {
      const Bone bone = *bone_from_name(name);
      taught.push_back(bone == Bone::kNeck
                           ? at
                           : places[static_cast<std::size_t>(walk.skeleton->joint_of(bone))]);
    }
    return style::BoneTurns::make(spec, taught, skeleton).value();
  }
  // A change of one bone.
  [[nodiscard]] std::vector<float> change_of(Bone bone, const Vector3d& turn_rad) const {
    std::vector<float> change(dims, 0.0F);
    for (std::size_t d = 0; d < dims; ++d) {
      const auto joint = space.skeleton_joint_of_dim(static_cast<int>(d));
      if (joint != walk.skeleton->joint_of(bone)) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        change[d + i] = static_cast<float>(turn_rad[static_cast<int>(i)]);
      }
      break;
    }
    return change;
  }
  // From one bone to another, seen from the heading.
  [[nodiscard]] Vector3d direction(const Frame& frame, Bone from, Bone to) const {
    const auto pose = motion::world_pose(*walk.skeleton, frame);
    const auto at = [&](Bone bone) {
      return pose.position_m[static_cast<std::size_t>(walk.skeleton->joint_of(bone))];
    };
    return axis_rotation(Axis::kY, -0.4) * (at(to) - at(from)).normalized();
  }
};

}  // namespace

TEST_CASE("who walks as the training does gets the same turns of joints", "[style][bone_turns]") {
  const Build build;
  const Frame plain = build.walk.frame(20);
  const auto q = build.vector_of(plain);
  const auto change = build.change_of(Bone::kSpine, {0.3, 0.1, -0.2});
  Frame own = plain;
  build.space.add(own, 0.4, q, change);
  Frame carried = plain;
  std::vector<float> without_arms = build.all;
  build.turns.add(carried, 0.4, q, change, without_arms);
  for (const Bone bone : {Bone::kHips, Bone::kSpine, Bone::kHead, Bone::kLeftUpperLeg}) {
    const auto j = static_cast<std::size_t>(build.walk.skeleton->joint_of(bone));
    CHECK(angle_between_rad(to_eigen_double(own.rotation_xyzw[j]),
                            to_eigen_double(carried.rotation_xyzw[j])) < 1e-5);
  }
}

TEST_CASE("an arm that hangs another way than in training gets the taught change of direction",
          "[style][bone_turns]") {
  const Build build;
  const Frame taught = build.walk.frame(20);
  const auto from = build.vector_of(taught);
  const auto change = build.change_of(Bone::kLeftUpperArm, {0.0, 0.5, 0.3});
  Frame goal = taught;
  build.space.add(goal, 0.4, from, change);
  // The walker's forearm is twisted by much and its arm a little away from the training's.
  Frame walker = taught;
  build.space.add(walker, 0.4, from, build.change_of(Bone::kLeftUpperArm, {1.2, 0.2, 0.3}));
  Frame styled = walker;
  build.turns.add(styled, 0.4, build.vector_of(taught), change, build.all);
  const auto arm = [&](const Frame& frame) {
    return build.direction(frame, Bone::kLeftUpperArm, Bone::kLeftLowerArm);
  };
  const Vector3d wanted = (arm(walker) + arm(goal) - arm(taught)).normalized();
  CHECK((arm(styled) - wanted).norm() < 0.02);
  CHECK((arm(styled) - arm(walker)).norm() > 0.3);
  // By turns of joints it would end somewhere else.
  Frame by_turns = walker;
  build.space.add(by_turns, 0.4, build.vector_of(walker), change);
  CHECK((arm(by_turns) - wanted).norm() > 0.1);
}

TEST_CASE("what takes no part rides on the bone above it", "[style][bone_turns]") {
  const Build build;
  const Frame plain = build.walk.frame(20);
  const auto q = build.vector_of(plain);
  std::vector<float> change(build.dims, 0.2F);
  Frame still = plain;
  build.turns.add(still, 0.4, q, change, std::vector<float>(build.dims, 0.0F));
  CHECK(still.rotation_xyzw == plain.rotation_xyzw);
  Frame unmeasured = plain;
  const auto head = static_cast<std::size_t>(build.walk.skeleton->joint_of(Bone::kHead));
  unmeasured.valid[head] = false;
  build.turns.add(unmeasured, 0.4, q, change, build.all);
  CHECK(unmeasured.rotation_xyzw[head] == plain.rotation_xyzw[head]);
  CHECK(unmeasured.rotation_xyzw != plain.rotation_xyzw);
}

TEST_CASE("a trunk that is divided elsewhere turns as what of the taught one lies there",
          "[style][bone_turns]") {
  Build build;
  const Skeleton& skeleton = *build.walk.skeleton;
  const auto place = [places = style::trunk_places(skeleton), &skeleton](Bone bone) {
    return places[static_cast<std::size_t>(skeleton.joint_of(bone))];
  };
  REQUIRE(place(Bone::kHips) == 0.0);
  REQUIRE(place(Bone::kSpine) < place(Bone::kChest));
  CHECK(place(Bone::kHead) == 1.0);
  CHECK(place(Bone::kLeftUpperArm) == -1.0);
  // Where the walker's chest is, the figure of training had its spine.
  std::vector<double> taught;
  for (const std::string& name : build.spec.joints) {
    const Bone bone = *bone_from_name(name);
    taught.push_back(bone == Bone::kSpine   ? place(Bone::kChest)
                     : bone == Bone::kChest ? place(Bone::kNeck)
                                            : place(bone));
  }
  build.turns = style::BoneTurns::make(build.spec, taught, skeleton).value();
  const Frame plain = build.walk.frame(20);
  const Vector3d bow_rad(0.4, 0.0, 0.0);
  Frame styled = plain;
  build.turns.add(styled, 0.4, build.vector_of(plain), build.change_of(Bone::kSpine, bow_rad),
                  build.all);
  const auto before = motion::world_pose(skeleton, plain);
  const auto after = motion::world_pose(skeleton, styled);
  const auto turned_rad = [&](Bone bone) {
    const auto j = static_cast<std::size_t>(skeleton.joint_of(bone));
    return angle_between_rad(before.rotation[j], after.rotation[j]);
  };
  CHECK(turned_rad(Bone::kSpine) < 1e-5);
  CHECK(turned_rad(Bone::kChest) == Approx(0.4).margin(1e-3));
  CHECK(turned_rad(Bone::kHead) == Approx(0.4).margin(1e-3));
}

TEST_CASE("a longer neck that turns as the taught one does not lean the head further",
          "[style][bone_turns]") {
  Build build;
  const Skeleton& skeleton = *build.walk.skeleton;
  const auto places = style::trunk_places(skeleton);
  const double neck = places[static_cast<std::size_t>(skeleton.joint_of(Bone::kNeck))];
  const double length = 0.5 * (1.0 - neck);  // of the taught neck, half the walker's
  build.turns = build.turns_of_taught_neck(1.0 - length, skeleton);
  const Frame plain = build.walk.frame(20);
  const auto change = build.change_of(Bone::kNeck, {0.4, 0, 0});
  const auto bent_rad = [&](const Frame& in, const std::vector<float>& shares, Bone from, Bone to) {
    Frame styled = in;
    build.turns.add(styled, 0.4, build.vector_of(plain), change, shares);
    const auto pitch_rad = [&](const Frame& frame) {
      const Vector3d along = build.direction(frame, from, to);
      return std::atan2(along.z(), along.y());
    };
    return pitch_rad(styled) - pitch_rad(in);
  };
  CHECK(bent_rad(plain, build.all, Bone::kNeck, Bone::kHead) > 0.25);
  CHECK(bent_rad(plain, build.all, Bone::kHips, Bone::kHead) ==
        Approx(0.4 * length).margin(0.1 * length));
  // The trunk gives back what the neck turns, and no more.
  const double whole_rad = bent_rad(plain, build.all, Bone::kHips, Bone::kNeck);
  CHECK(whole_rad < -0.01);
  const auto neck_dim =
      static_cast<std::size_t>(std::ranges::find(build.spec.joints, bone_name(Bone::kNeck)) -
                               build.spec.joints.begin()) *
      3;
  auto masked = build.all;
  masked[neck_dim] = 0.5F;
  CHECK(bent_rad(plain, masked, Bone::kHips, Bone::kNeck) == Approx(0.5 * whole_rad).epsilon(0.05));
  masked[neck_dim] = 0.0F;
  CHECK(bent_rad(plain, masked, Bone::kHips, Bone::kNeck) == Approx(0.0).margin(1e-5));
  Frame unmeasured = plain;
  unmeasured.valid[static_cast<std::size_t>(skeleton.joint_of(Bone::kNeck))] = false;
  CHECK(bent_rad(unmeasured, build.all, Bone::kHips, Bone::kNeck) == Approx(0.0).margin(1e-5));
}

TEST_CASE("a trunk of one bone without a neck of any length turns by finite angles",
          "[style][bone_turns]") {
  Build build;
  Skeleton thin = *build.walk.skeleton;
  int j = thin.joint_of(Bone::kHead);
  for (; j != thin.joint_of(Bone::kSpine); j = thin.joints[static_cast<std::size_t>(j)].parent) {
    thin.joints[static_cast<std::size_t>(j)].offset_m.setZero();
  }
  build.turns = build.turns_of_taught_neck(0.8, thin);
  Frame styled = build.walk.frame(20);
  build.turns.add(styled, 0.4, build.vector_of(styled), build.change_of(Bone::kNeck, {0.4, 0, 0}),
                  build.all);
  for (std::size_t joint = 0; joint < styled.joint_count; ++joint) {
    for (const float part : styled.rotation_xyzw[joint]) CHECK(std::isfinite(part));
  }
}
