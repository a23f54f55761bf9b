// Bones of one NatNet skeleton in one frame: local and global coordinates, bones that are not
// tracked.
#include <catch2/catch.hpp>

#include "drivers/natnet/decoder.hpp"
#include "drivers/natnet/layout.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers {
namespace {

using natnet::Coordinates;

// Three bones in a row.
natnet::BodyTable bone_chain() {
  return {.id = 1,
          .is_skeleton = true,
          .bone_ids = {1, 2, 3},
          .parents = {-1, 0, 1},
          .offsets_m = {{0, 1, 0}, {0, 0.5F, 0}, {0, 0.5F, 0}}};
}

}  // namespace

TEST_CASE("a child of a NatNet bone that is not tracked keeps its direction in the room") {
  const auto table = bone_chain();
  const Quatf lean = from_eigen(axis_rotation(Axis::kX, 0.4));
  const Quatf turn = from_eigen(axis_rotation(Axis::kY, 0.7));
  const Quatf bend = from_eigen(axis_rotation(Axis::kZ, -0.2));
  for (const bool tracked : {true, false}) {
    natnet::SkeletonPose pose(table);
    REQUIRE(pose.add({.id = 1 << 16 | 1, .position_m = {0, 1, 0}, .rotation_xyzw = lean}));
    REQUIRE(pose.add({.id = 1 << 16 | 2, .rotation_xyzw = turn, .tracked = tracked}));
    REQUIRE(pose.add({.id = 1 << 16 | 3, .rotation_xyzw = bend}));
    Frame frame;
    REQUIRE(pose.fill(Coordinates::kGlobal, frame));
    CHECK(frame.valid[1] == tracked);
    const Eigen::Quaterniond composed = to_eigen_double(frame.rotation_xyzw[0]) *
                                        to_eigen_double(frame.rotation_xyzw[1]) *
                                        to_eigen_double(frame.rotation_xyzw[2]);
    CHECK(angle_between_rad(composed, to_eigen_double(bend)) < 1e-6);
    REQUIRE(pose.fill(Coordinates::kLocal, frame));
    CHECK(frame.rotation_xyzw[2] == bend);
  }
}

}  // namespace posed::drivers
