// Forward kinematics, closest points, gaps and their slopes.
#include "models/hand/geometry.hpp"

#include <catch2/catch.hpp>

#include "models/hand/constraint_solver.hpp"
#include "models/hand/contacts.hpp"
#include "models/hand/segments.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/golden_json.hpp"
#include "tests/unit/models/hand/hand_poses.hpp"

namespace posed::hand {
namespace {

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

}  // namespace

TEST_CASE("closest points of segments agree with the fixture, points and parallels included") {
  const auto geom = test::golden_json("geom.json");
  REQUIRE(geom["segseg"].size() == 40);
  for (const auto& one : geom["segseg"]) {
    const Closest closest = closest_points(vector_of(one["p1"]), vector_of(one["q1"]),
                                           vector_of(one["p2"]), vector_of(one["q2"]));
    CHECK(closest.apart.norm() == Approx(one["dist"].get<double>()).margin(1e-9));
  }
}

TEST_CASE("bones start at the skeleton's joints, on either hand") {
  std::mt19937 random(3);
  const HandGeometry geometry = hand_geometry(default_hand_shape());
  for (int i = 0; i < 20; ++i) {
    const HandAngles angles = test::any_angles(random, 1.2);
    HandPose pose;
    place(geometry, angles, pose);
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const Skeleton skeleton = hand_skeleton(side);
      Frame frame;
      set_hand_angles(skeleton, angles, frame);
      std::array<Eigen::Vector3d, kHandSkeletonJoints> at_m;
      std::array<Eigen::Quaterniond, kHandSkeletonJoints> turned;
      at_m[0].setZero();
      turned[0].setIdentity();
      for (std::size_t j = 1; j < kHandSkeletonJoints; ++j) {
        const Joint& joint = skeleton.joints[j];
        const auto parent = static_cast<std::size_t>(joint.parent);
        at_m[j] = at_m[parent] + turned[parent] * joint.offset_m;
        turned[j] = turned[parent] * to_eigen_double(frame.rotation_xyzw[j]);
        CHECK((at_m[j] - mirrored(side, pose.from_m[j - 1])).norm() < 1e-7);
        if (!joint.end_site_m) continue;
        const Eigen::Vector3d tip_m = at_m[j] + turned[j] * *joint.end_site_m;
        CHECK((tip_m - mirrored(side, pose.to_m[j - 1])).norm() < 1e-7);
      }
    }
  }
}

TEST_CASE("the slopes of gaps are their derivatives") {
  std::mt19937 random(5);
  const HandGeometry geometry = hand_geometry(default_hand_shape());
  const auto gap = [&](const HandAngles& angles, std::size_t pair) {
    HandPose pose;
    Gaps gaps_m;
    place(geometry, angles, pose);
    find_gaps(geometry, pose, 1.0, gaps_m);
    return gaps_m[pair];
  };
  double worst = 0.0;
  for (std::size_t pair = 0; pair < kPairs.size(); ++pair) {
    HandAngles angles = test::any_angles(random, 0.6);
    HandPose pose;
    place(geometry, angles, pose);
    const GapSlope slope = slope_of(pose, kPairs[pair]);
    for (int c = 0; c < kFingerChannels; ++c) {
      for (const bool first : {true, false}) {
        const int finger = (first ? kPairs[pair].a : kPairs[pair].b) / kFingerJoints;
        double& angle_rad = angles[static_cast<std::size_t>(kFingerChannels * finger + c)];
        const double before = angle_rad;
        angle_rad = before + 1e-6;
        const double more = gap(angles, pair);
        angle_rad = before - 1e-6;
        const double numeric = (more - gap(angles, pair)) / 2e-6;
        angle_rad = before;
        worst = std::max(worst, std::abs(numeric - (first ? slope.a : slope.b)[c]));
      }
    }
  }
  CHECK(worst < 1e-6);
}

TEST_CASE("a flat hand has gaps, crossed fingers have none") {
  const HandGeometry geometry = hand_geometry(default_hand_shape());
  CHECK(min_gap_m(geometry, {}) > 1e-3);
  CHECK(min_gap_m(geometry, test::crossed()) < -5e-3);
}

}  // namespace posed::hand
