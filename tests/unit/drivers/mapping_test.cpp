// The user's mapping of a live source's joints: whose it is, and what is said of the others.
#include <catch2/catch.hpp>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/mapping.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/has.hpp"

namespace posed::drivers {
namespace {

Body body_of(std::string name, std::vector<std::string> joints) {
  auto skeleton = std::make_shared<Skeleton>();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = joints[j];
    joint.parent = static_cast<int>(j) - 1;
    joint.offset_m = {0.0, 0.3, 0.0};
  }
  skeleton->joints[0].bone = Bone::kHead;  // the driver's guess
  REQUIRE(skeleton->finish());
  return {.name = std::move(name), .skeleton = std::move(skeleton)};
}

TEST_CASE("a user's mapping wins over the guess for the bodies whose joints it names") {
  const auto mapping = parse_mapping(
      "name = \"rig\"\n[bones]\nhips = \"root\"\nspine = \"b1\"\n"
      "leftIndexProximal = \"no glove\"\n[T]\nb1 = [0, 90, 0]\n",
      "map.toml");
  REQUIRE(mapping);
  SourceLayout layout;
  layout.bodies = {body_of("Ann", {"root", "b1", "b2"}), body_of("Prop", {"rigid body"})};
  const auto guessed = layout.bodies;
  CHECK(use_mapping(*mapping, layout).empty());
  const Skeleton& ann = *layout.bodies[0].skeleton;
  CHECK(ann.joint_of(Bone::kHips) == 0);
  CHECK(ann.joint_of(Bone::kSpine) == 1);
  CHECK(ann.joint_of(Bone::kHead) == -1);
  CHECK(angle_between_rad(ann.joints[1].T_world_joint, axis_rotation(Axis::kY, 90 * kDegree)) <
        1e-9);
  CHECK(ann.id != guessed[0].skeleton->id);
  CHECK(layout.bodies[1].skeleton == guessed[1].skeleton);

  layout.bodies = {body_of("Bo", {"root", "c1"}), body_of("Cy", {"root", "d1"})};
  const auto others = layout.bodies;
  const std::string misfit = use_mapping(*mapping, layout);
  CHECK(test::has(misfit, "map.toml does not fit ... 'Bo' ... no joint b1 ... 1 more"));
  CHECK(layout.bodies[0].skeleton == others[0].skeleton);
  CHECK(layout.bodies[1].skeleton == others[1].skeleton);

  auto lying = *mapping;
  lying.profile.up = UpAxis::kPlusZ;
  layout.bodies = {body_of("Ann", {"root", "b1", "b2"})};
  CHECK(test::has(use_mapping(lying, layout), "T frames ... +z points up"));
}

}  // namespace
}  // namespace posed::drivers
