#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/rotation.hpp"

using posed::motion::make_walker;
using posed::motion::WalkerFamily;

TEST_CASE("a synthetic walker is the same every time and differs between people and families",
          "[walker]") {
  const auto first = make_walker({.family = WalkerFamily::kMarch, .person = 3});
  const auto again = make_walker({.family = WalkerFamily::kMarch, .person = 3});
  const auto other = make_walker({.family = WalkerFamily::kMarch, .person = 4});
  const auto sway = make_walker({.family = WalkerFamily::kSway, .person = 3});
  REQUIRE(first);
  REQUIRE(again);
  REQUIRE(other);
  REQUIRE(sway);
  CHECK(first->frames() == 180);
  CHECK(first->channels == again->channels);
  const auto rms_deg = [](const posed::clip::Clip& a, const posed::clip::Clip& b) {
    const auto n = a.channels.cols() - 3;
    return 57.29578 *
           std::sqrt((a.channels.rightCols(n) - b.channels.rightCols(n)).array().square().mean());
  };
  CHECK(rms_deg(*first, *other) > 1.0);
  CHECK(rms_deg(*first, *sway) > 4.0);
}

TEST_CASE("a synthetic walker has the legs that the phase is found by", "[walker]") {
  const auto walk = make_walker({});
  REQUIRE(walk);
  CHECK(walk->skeleton->joint_of(posed::Bone::kHips) == 0);
  CHECK(walk->skeleton->joint_of(posed::Bone::kLeftUpperLeg) > 0);
  CHECK(walk->skeleton->joint_of(posed::Bone::kRightUpperLeg) > 0);
  CHECK(walk->skeleton->joint_of(posed::Bone::kLeftHand) > 0);
}

// The last frame of a round is one step before the first: a loop shows no jump, of no joint.
TEST_CASE("a walker's round turns, stops, starts and ends where it began", "[walker]") {
  const auto walk = make_walker(
      {.family = WalkerFamily::kTired, .seconds = 20.0, .noise_deg = 0.0, .round = true});
  REQUIRE(walk);
  const int last = walk->frames() - 1;
  const auto moved_m = [&](int from, int to) {
    return (walk->channels.row(to) - walk->channels.row(from)).head<3>().norm();
  };
  const auto turned_rad = [&](int from, int to) {
    const posed::Frame a = walk->frame(from), b = walk->frame(to);
    double most = 0.0;
    for (int j = 0; j < a.joint_count; ++j) {
      most = std::max(most, posed::angle_between_rad(posed::to_eigen_double(a.rotation_xyzw[j]),
                                                     posed::to_eigen_double(b.rotation_xyzw[j])));
    }
    return most;
  };
  double usual_rad = 0.0;
  int stands = 0, walks = 0;
  for (int i = 0; i < last; ++i) {
    usual_rad = std::max(usual_rad, turned_rad(i, i + 1));
    const double speed_m_s = moved_m(i, i + 1) * walk->frame_rate_hz;
    stands += speed_m_s < 0.01 && turned_rad(i, i + 1) < 0.002;
    walks += speed_m_s > 0.4;
  }
  CHECK(moved_m(last, 0) == Approx(moved_m(0, 1)).epsilon(0.15));
  CHECK(moved_m(last, last / 2) > 1.0);
  CHECK(turned_rad(last, 0) <= usual_rad);
  CHECK(stands > 45);  // twice a second
  CHECK(walks > 360);
  // Half a round later he goes the other way.
  const Eigen::Vector3d ahead = (walk->channels.row(1) - walk->channels.row(0)).head<3>();
  const Eigen::Vector3d back = (walk->channels.row(301) - walk->channels.row(300)).head<3>();
  CHECK(ahead.z() > 0.01);
  CHECK((ahead + back).norm() == Approx(0.0).margin(0.01));
  CHECK_FALSE(make_walker({.seconds = 5.0, .round = true}));
  CHECK_FALSE(make_walker({.seconds = 0.0, .round = true}));
}
