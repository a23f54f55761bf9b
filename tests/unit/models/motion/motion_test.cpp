// Resampling, heading and leg signal: the preparation of a clip for training.
#include "models/motion/motion.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <ranges>
#include <vector>

#include "models/motion/heading.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/clip/mirror.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using namespace posed::motion;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kPi = std::numbers::pi;

Motion walker(double rate_hz, double noise_deg = 0.0) {
  auto clip = make_walker({.seconds = 5.0, .rate_hz = rate_hz, .noise_deg = noise_deg});
  REQUIRE(clip.has_value());
  auto motion = motion_of(*clip);
  REQUIRE(motion.has_value());
  return std::move(*motion);
}

// The whole walk turned about +Y.
Motion turned(Motion motion, double heading_rad) {
  const Eigen::Quaterniond turn = axis_rotation(Axis::kY, heading_rad);
  for (Frame& frame : motion.frames) {
    frame.rotation_xyzw[0] = from_eigen(turn * to_eigen_double(frame.rotation_xyzw[0]));
    const auto& p = frame.root_position_m;
    const Eigen::Vector3d at = turn * Eigen::Vector3d(p[0], p[1], p[2]);
    for (int i = 0; i < 3; ++i) frame.root_position_m[i] = static_cast<float>(at[i]);
  }
  return motion;
}

double worst_angle_rad(const Motion& a, const Motion& b) {
  double worst = 0.0;
  REQUIRE(a.size() == b.size());
  for (int t = 0; t < a.size(); ++t) {
    for (int j = 0; j < a.frames[t].joint_count; ++j) {
      // A heel that lands turns its foot faster than 30 frames a second can show.
      const std::string& name = a.skeleton->joints[j].name;
      if (name.contains("Foot") || name.contains("Toes")) continue;
      worst = std::max(worst, angle_between_rad(to_eigen_double(a.frames[t].rotation_xyzw[j]),
                                                to_eigen_double(b.frames[t].rotation_xyzw[j])));
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("A rest pose in front of a motion is found, and an ordinary first frame is not one",
          "[motion]") {
  Motion motion = walker(120.0, 0.3);
  CHECK_FALSE(begins_with_added_pose(motion));
  const int frames = motion.size();
  Frame rest = motion.frames.front();
  rest.rotation_xyzw.fill(kIdentity);
  motion.frames.insert(motion.frames.begin(), rest);
  CHECK(begins_with_added_pose(motion));
  drop_first_frame(motion);
  CHECK(motion.size() == frames);
  CHECK_FALSE(begins_with_added_pose(motion));
}

TEST_CASE("A mirrored clip has its partners by their places, whatever they are called",
          "[motion]") {
  auto clip = make_walker({.seconds = 1.0, .rate_hz = 30.0}).value();
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (const auto& [name, x_m] : {std::pair{"tail_01", 0.0}, {"pocket.L", 0.1}, {"bag", -0.1}}) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = name;
    joint.parent = skeleton->joint_of(Bone::kHips);
    joint.offset_m = {x_m, -0.1, 0.0};
    skeleton->channels.push_back(
        {.joint = static_cast<std::uint16_t>(skeleton->joints.size() - 1), .axis = Axis::kX});
  }
  REQUIRE(skeleton->finish());
  clip.skeleton = skeleton;
  clip.channels.conservativeResize(Eigen::NoChange, clip.channels.cols() + 3);
  const Eigen::Index first = clip.channels.cols() - 3;
  clip.channels.rightCols(3).rowwise() = Eigen::RowVector3d(0.1, 0.2, 0.3);
  const auto other = clip::mirrored(clip);
  REQUIRE(other);
  CHECK(other->channels(5, first) == Approx(0.1));
  CHECK(other->channels(5, first + 1) == Approx(0.3));
  CHECK(other->channels(5, first + 2) == Approx(0.2));
  skeleton = std::make_shared<Skeleton>(*skeleton);
  skeleton->joints.back().offset_m.z() = 0.3;
  REQUIRE(skeleton->finish());
  clip.skeleton = skeleton;
  CHECK(test::has(clip::mirrored(clip).error().message, "has no partner"));
}

TEST_CASE("CMU's clips can be mirrored", "[motion][real]") {
  for (const char* name : {"cmu/02_04.bvh", "cmu/07_01.amc"}) {
    const auto path = test::shared(std::string("data/") + name);
    if (!path) SKIP_WITHOUT_SHARED();
    const auto clip = clip::read_clip(*path).value();
    const auto other = clip::mirrored(clip);
    INFO(name << (other ? "" : other.error().message));
    CHECK(other);
  }
}

TEST_CASE("A mirrored clip does with the left what was done with the right", "[motion]") {
  const auto clip = make_walker({.seconds = 1.0, .rate_hz = 30.0}).value();
  const auto other = clip::mirrored(clip);
  REQUIRE(other);
  const Skeleton& skeleton = *clip.skeleton;
  const auto place = [&](const Frame& frame, int joint) -> Vector3d {
    Quaterniond above = Quaterniond::Identity();
    Vector3d place_m = Vector3d::Zero();
    std::vector<int> chain;
    for (int j = joint; j != skeleton.root_joint; j = skeleton.joints[j].parent) chain.push_back(j);
    above = to_eigen_double(frame.rotation_xyzw[skeleton.root_joint]);
    for (int i = 0; i < 3; ++i) place_m[i] = frame.root_position_m[i];
    for (const int j : std::views::reverse(chain)) {
      place_m += above * skeleton.joints[j].offset_m;
      above = above * to_eigen_double(frame.rotation_xyzw[j]);
    }
    return place_m;
  };
  for (const auto& [left, right] : {std::pair{Bone::kLeftHand, Bone::kRightHand},
                                    {Bone::kRightFoot, Bone::kLeftFoot},
                                    {Bone::kHead, Bone::kHead}}) {
    for (int t = 0; t < clip.frames(); ++t) {
      const Vector3d was = place(clip.frame(t), skeleton.joint_of(left));
      const Vector3d is = place(other->frame(t), skeleton.joint_of(right));
      CHECK((is - was.cwiseProduct(Vector3d(-1.0, 1.0, 1.0))).norm() < 1e-4);
    }
  }
  const auto back = clip::mirrored(*other);
  REQUIRE(back);
  for (int t = 0; t < clip.frames(); ++t) {
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      CHECK(angle_between_rad(to_eigen_double(back->frame(t).rotation_xyzw[j]),
                              to_eigen_double(clip.frame(t).rotation_xyzw[j])) < 1e-4);
    }
  }
}

TEST_CASE("CMU's BVH files begin with an added pose where they are said to", "[motion][real]") {
  if (!test::shared("data/cmu/02_02.amc")) SKIP_WITHOUT_SHARED();
  for (const auto& [name, added] : {std::pair{"cmu/02_03.bvh", true},
                                    {"cmu/02_04.bvh", true},
                                    {"cmu/07_01.bvh", true},
                                    {"cmu/09_01.bvh", true},
                                    {"cmu/16_15.bvh", false},
                                    {"styles/dataset-2_walk_masculine_001.bvh", false}}) {
    INFO(name);
    const auto path = test::shared(std::string("data/") + name);
    REQUIRE(path);
    CHECK(begins_with_added_pose(motion_of(clip::read_clip(*path).value()).value()) == added);
  }
}

TEST_CASE("The zero-phase low-pass agrees with scipy's filtfilt", "[motion]") {
  const VectorXd t = VectorXd::LinSpaced(40, 0.0, 39.0);
  const VectorXd x =
      (0.3 * t.array()).sin() + 0.3 * (2.1 * t.array()).cos() + 0.01 * t.array().square();
  const VectorXd y = low_pass_zero_phase(x, 10.0 / 60.0);
  const std::array<std::pair<int, double>, 6> want{{{0, 0.287889228819409},
                                                    {1, 0.506666717469726},
                                                    {7, 1.3025526040923},
                                                    {20, 3.71531653966889},
                                                    {38, 13.7804199865137},
                                                    {39, 14.7046470531559}}};
  for (const auto& [frame, value] : want) CHECK(y[frame] == Approx(value).epsilon(1e-10));
  CHECK(low_pass_zero_phase(x.head(1), 0.3) == x.head(1));
  CHECK(low_pass_zero_phase(VectorXd::Constant(5, 2.0), 0.3).isConstant(2.0, 1e-12));
}

TEST_CASE("Resampling keeps the walk: same rate untouched, 120 to 30 and 30 to 120 close",
          "[motion]") {
  const Motion at_30 = walker(30.0);
  const Motion at_120 = walker(120.0);
  CHECK(worst_angle_rad(resample(at_30, 30.0), at_30) == 0.0);
  const Motion down = resample(at_120, 30.0);
  CHECK(down.size() == at_30.size());
  CHECK(worst_angle_rad(down, at_30) < 0.05);
  const Motion up = resample(at_30, 120.0);
  CHECK(up.rate_hz == 120.0);
  Motion cut = at_120;
  cut.frames.resize(up.frames.size());
  CHECK(worst_angle_rad(up, cut) < 0.06);
  CHECK(resample(walker(100.0), 30.0).size() == 150);
}

TEST_CASE("The heading is the chord's, or the pelvis's where there is no chord", "[motion]") {
  for (const double heading_rad : {0.0, 1.2, -2.9}) {
    Motion walk = turned(walker(30.0), heading_rad);
    CHECK(std::remainder(walk_heading_rad(walk) - heading_rad, 2 * kPi) ==
          Approx(0.0).margin(0.02));
    for (Frame& frame : walk.frames) frame.root_position_m = {0.0F, 0.9F, 0.0F};
    CHECK(std::remainder(walk_heading_rad(walk) - heading_rad, 2 * kPi) == Approx(0.0).margin(0.1));
  }
  const auto moved = root_positions_m(turned(walker(30.0), 1.0), 1.0);
  CHECK(std::abs(moved(149, 0) - moved(0, 0)) < 0.1);
  CHECK(moved(149, 2) - moved(0, 2) > 3.0);
}

TEST_CASE("A live heading is on who goes round a circle, smooths the stride, at any rate",
          "[motion]") {
  constexpr double kDegree = kPi / 180.0;
  // How far it is from a walker who turns by `turn`, and sways by `sway` once a second.
  const auto worst_deg = [](double rate_hz, double turn_deg_s, double sway_deg) {
    LiveHeading heading;
    double worst = 0.0;
    for (int i = 0; i < 16 * rate_hz; ++i) {
      const double t = i / rate_hz;
      const double way_rad = turn_deg_s * kDegree * t;
      const double seen_rad = way_rad + sway_deg * kDegree * std::sin(2.0 * kPi * t);
      CHECK_FALSE(heading.update(unwrap_near(seen_rad, 0.0), 1.0 / rate_hz));
      if (t < 10.0) continue;
      worst = std::max(worst, std::abs(unwrap_near(heading.value_rad() - way_rad, 0.0)) / kDegree);
    }
    return worst;
  };
  for (const double rate_hz : {30.0, 60.0, 240.0}) {
    CAPTURE(rate_hz);
    CHECK(worst_deg(rate_hz, 90.0, 0.0) < 0.1);
    CHECK(worst_deg(rate_hz, -45.0, 8.0) == Approx(2.54).margin(0.1));
  }
}

TEST_CASE("The leg signal has the stride's period and the right leg forward at its peak",
          "[motion]") {
  const Motion walk = walker(30.0);
  const auto signal = leg_signal(walk);
  REQUIRE(signal.has_value());
  CHECK(signal->maxCoeff() > 0.6);  // radians: thighs swing by 27 degrees each way
  const auto stride = style::find_stride(*signal, 30.0);
  CHECK(2 * kPi / stride.dtheta > 0.85 * 30.0 * 0.95);
  CHECK(2 * kPi / stride.dtheta < 30.0 / 0.85 * 1.05);
  int peak = 0;
  signal->maxCoeff(&peak);
  // The frame where the right thigh is ahead of the left one, by forward kinematics of the thigh
  // alone.
  const auto thigh = [&](const char* name) {
    const int j = walk.skeleton->joint_index(name);
    const auto& frame = walk.frames[peak];
    return (to_eigen_double(frame.rotation_xyzw[j]) * -Eigen::Vector3d::UnitY()).z();
  };
  CHECK(thigh("RightUpperLeg") > thigh("LeftUpperLeg") + 0.4);
}

TEST_CASE("A derivative is exact on a parabola, and a single frame has none", "[motion]") {
  const VectorXd t = VectorXd::LinSpaced(10, 0.0, 9.0) / 30.0;
  const VectorXd rate = time_derivative(t.array().square().matrix(), 30.0);
  CHECK((rate - 2.0 * t).segment(1, 8).norm() < 1e-12);
  CHECK(time_derivative(t.head(1), 30.0)(0, 0) == 0.0);
}

TEST_CASE("A clip that cannot be learnt from is refused with its frame", "[motion]") {
  auto clip = make_walker({.seconds = 1.0});
  REQUIRE(clip.has_value());
  auto broken = *clip;
  broken.channels(4, 7) = std::nan("");
  const auto refused = motion_of(broken);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("frame 5") != std::string::npos);
  broken.channels.resize(0, clip->channels.cols());
  CHECK_FALSE(motion_of(broken).has_value());
  clip->frame_rate_hz = 0.0;
  CHECK_FALSE(motion_of(*clip).has_value());
}
