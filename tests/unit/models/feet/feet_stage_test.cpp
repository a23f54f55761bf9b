// The feet stage on a synthetic walker: feet stand, at any rate and in any mode.
#include <catch2/catch.hpp>

#include <limits>

#include "models/feet/foot_score.hpp"
#include "models/feet/leg_reach.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/unit/models/feet/standing_walker.hpp"

namespace posed::feet {
namespace {

using test::feet_stage;
using test::styled_walk;
using test::through;

double slide_cm_s(const test::StyledWalk& walk, const motion::Motion& moved) {
  return 100.0 * slide_m_s(walk.source, moved).value();
}

double furthest_m(const motion::Motion& a, const motion::Motion& b) {
  double furthest = 0.0;
  for (std::size_t t = 0; t < a.frames.size(); ++t) {
    furthest = std::max(furthest, test::root_apart_m(a.frames[t], b.frames[t]));
  }
  return furthest;
}

// How much higher the lowest point of the feet is in `moved`: the mean over the frames [m].
double floats_m(const motion::Motion& source, const motion::Motion& moved) {
  const Legs legs = Legs::find(*source.skeleton).value();
  const auto lowest_m = [&](const Frame& frame) {
    LegPose pose;
    legs.pose(frame, pose);
    double lowest = std::numeric_limits<double>::infinity();
    for (std::size_t leg = 0; leg < kLegs; ++leg) {
      for (std::size_t p = 0; p < kPoints; ++p) {
        if (!legs.leg(leg).has(p)) continue;
        lowest = std::min(lowest, pose.point_from_root_m[leg][p].y());
      }
    }
    return test::root_of(frame).y() + lowest;
  };
  double sum_m = 0.0;
  for (std::size_t t = 0; t < source.frames.size(); ++t) {
    sum_m += lowest_m(moved.frames[t]) - lowest_m(source.frames[t]);
  }
  return sum_m / static_cast<double>(source.frames.size());
}

}  // namespace

TEST_CASE("standing feet slide without the stage, and stand with it", "[feet]") {
  for (const double rate_hz : {30.0, 60.0, 120.0}) {
    INFO(rate_hz);
    const auto walk = styled_walk(rate_hz, 6.0);
    const double source_cm_s = slide_cm_s(walk, walk.source);
    const double before_cm_s = slide_cm_s(walk, walk.styled);
    CHECK(source_cm_s < 5.0);
    CHECK(before_cm_s > 20.0);
    for (const char* root : {"stride", "actor"}) {
      INFO(root);
      const auto stage = feet_stage(walk.source, root);
      const auto moved = through(*stage, walk);
      CHECK(slide_cm_s(walk, moved) < source_cm_s + 0.2 * before_cm_s);
      CHECK(sink_m(walk.source, moved).value() < 0.01);
      CHECK(std::abs(floats_m(walk.source, moved)) < 0.01);
    }
  }
}

TEST_CASE("a root that strides walks as far as the styled legs do; an actor's stays", "[feet]") {
  const auto walk = styled_walk(60.0, 8.0);
  const double speed_m_s = root_speed_m_s(walk.source, 1.0);
  const auto stride = feet_stage(walk.source, "stride");
  const auto walked = through(*stride, walk);
  CHECK(root_speed_m_s(walked, 1.0) < 0.85 * speed_m_s);
  CHECK(root_speed_m_s(walked, 1.0) > 0.5 * speed_m_s);
  const auto actor = feet_stage(walk.source, "actor");
  const auto acted = through(*actor, walk);
  CHECK(furthest_m(acted, walk.source) < 0.0801);
  CHECK(root_speed_m_s(acted, 1.0) == Approx(speed_m_s).epsilon(0.02));
}

TEST_CASE("who walks on a treadmill does not walk off with a style's speed", "[feet]") {
  const RootChange faster{.height_m = 0.0F, .velocity_m_s = {0.0F, 0.0F, 0.5F}};
  const auto gone_m = [&](bool treadmill) {
    auto walk = styled_walk(60.0, 8.0);
    const auto stage = feet_stage(walk.source, "stride");
    test::LastFrame out;
    double furthest = 0.0;
    for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
      Frame in = walk.source.frames[t];
      Frame styled = walk.styled.frames[t];
      if (treadmill) in.root_position_m[2] = styled.root_position_m[2] = 0.0F;
      stage->process({.frame = styled, .input = &in, .root = &faster}, out);
      furthest = std::max(furthest, test::root_apart_m(in, out.out));
    }
    return furthest;
  };
  CHECK(gone_m(true) < 0.3);
  CHECK(gone_m(false) > 0.3);  // of him who walks the style's steps are shorter
}

TEST_CASE("the same walk at another rate gets the same root", "[feet]") {
  const auto slow = styled_walk(30.0, 6.0);
  const auto at_30 = feet_stage(slow.source, "stride");
  const auto slow_out = through(*at_30, slow);
  for (const double rate_hz : {10.0, 120.0, 1000.0}) {
    INFO(rate_hz);
    const auto fast = styled_walk(rate_hz, 6.0);
    const auto stage = feet_stage(fast.source, "stride");
    const auto out = through(*stage, fast);
    const auto gone_m = [](const motion::Motion& motion) {
      return (test::root_of(motion.frames.back()) - test::root_of(motion.frames.front())).norm();
    };
    CHECK(gone_m(out) / gone_m(fast.source) ==
          Approx(gone_m(slow_out) / gone_m(slow.source)).margin(0.06));
  }
}

TEST_CASE("with the root off, and without a style, every bit stays", "[feet]") {
  const auto walk = styled_walk(60.0, 2.0);
  const auto off = feet_stage(walk.source, "off");
  const auto stride = feet_stage(walk.source, "stride");
  for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
    const Frame& source = walk.source.frames[t];
    const Frame& styled = walk.styled.frames[t];
    CHECK(test::same_pose(through(*off, source, styled), styled));
    CHECK(test::same_pose(through(*stride, source, source), source));
  }
}

TEST_CASE("when the style fades out, the output becomes the input again", "[feet]") {
  for (const char* root : {"stride", "actor"}) {
    INFO(root);
    const auto walk = styled_walk(60.0, 14.0);
    const auto stage = feet_stage(walk.source, root);
    double before_m = 0.0;
    int same_from = -1;
    for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
      Frame styled = walk.source.frames[t];
      const double style = std::clamp((360.0 - static_cast<double>(t)) / 30.0, 0.0, 1.0);
      if (style > 0.0) test::restyle(*walk.source.skeleton, style, styled);
      const Frame out = through(*stage, walk.source.frames[t], styled);
      if (t == 330) before_m = test::root_apart_m(out, walk.source.frames[t]);
      const bool same = test::same_pose(out, walk.source.frames[t]);
      if (t < 360 || !same) same_from = -1;
      if (t >= 360 && same && same_from < 0) same_from = static_cast<int>(t);
    }
    CHECK(before_m > 0.02);
    REQUIRE(same_from > 0);
    CHECK(same_from < 360 + 60 * 6);  // six seconds after the last of the style
  }
}

// A resting avatar would glide by metres: a gate closes where a performer stops.
TEST_CASE("the avatar of a performer who stops stays where it is, without the style, too",
          "[feet]") {
  const auto walk = styled_walk(60.0, 7.0);
  const auto stage = feet_stage(walk.source, "stride");
  constexpr std::size_t kStops = 393, kRests = kStops + 60, kEnd = kStops + 300;  // both feet stand
  Frame rests;
  for (std::size_t t = 0; t < kEnd; ++t) {
    Frame source = walk.source.frames[std::min(t, kStops)];
    source.header.device_ns = static_cast<std::int64_t>(t) * 1'000'000'000 / 60;
    Frame styled = source;
    const double style = std::clamp((kStops + 30.0 - static_cast<double>(t)) / 30.0, 0.0, 1.0);
    if (style > 0.0) test::restyle(*walk.source.skeleton, style, styled);
    const Frame out = through(*stage, source, styled);
    if (t == kRests) rests = out;
    if (t > kRests) REQUIRE(test::root_apart_m(out, rests) < 0.005);
  }
  CHECK(test::root_apart_m(rests, walk.source.frames[kStops]) > 0.3);
}

TEST_CASE("the root can change while it runs, without a jump", "[feet]") {
  const auto walk = styled_walk(60.0, 12.0);
  const auto stage = feet_stage(walk.source, "stride");
  Eigen::Vector3d last_m = test::root_of(walk.source.frames[0]);
  for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
    if (t == 240)
      stage->set(test::parameter_index(feet_type(), "root"), static_cast<double>(RootMode::kActor));
    if (t == 480)
      stage->set(test::parameter_index(feet_type(), "root"), static_cast<double>(RootMode::kOff));
    const Frame out = through(*stage, walk.source.frames[t], walk.styled.frames[t]);
    const Eigen::Vector3d root_m = test::root_of(out);
    CHECK((root_m - last_m).norm() < 0.08);
    last_m = root_m;
  }
  CHECK(stage->state(test::parameter_index(feet_type(), "root")).now == 0.0);
  CHECK(test::root_apart_m(walk.styled.frames.back(), walk.source.frames.back()) == 0.0);
  CHECK((last_m - test::root_of(walk.source.frames.back())).norm() < 0.001);
}

TEST_CASE("the limit of the root can change while it runs, without a jump", "[feet]") {
  const auto walk = styled_walk(60.0, 8.0);
  const auto stage = feet_stage(walk.source, "actor");
  Eigen::Vector3d last_m = Eigen::Vector3d::Zero();
  for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
    if (t == 240) stage->set(test::parameter_index(feet_type(), "limit_m"), 0.005);
    if (t == 360) stage->set(test::parameter_index(feet_type(), "limit_m"), 0.08);
    const Frame out = through(*stage, walk.source.frames[t], walk.styled.frames[t]);
    const Eigen::Vector3d offset_m = test::root_of(out) - test::root_of(walk.source.frames[t]);
    INFO(t);
    if (t > 0) CHECK((offset_m - last_m).norm() < 0.025);
    if (t == 359) CHECK(offset_m.norm() < 0.01);
    last_m = offset_m;
  }
}

TEST_CASE("a knee that is bent backwards bends forward, without a flip", "[feet]") {
  const auto walk = styled_walk(60.0, 0.1);
  const Skeleton& skeleton = *walk.source.skeleton;
  const Legs legs = Legs::find(skeleton).value();
  const Leg& leg = legs.leg(0);
  constexpr double kDegree = std::numbers::pi / 180.0;
  for (const double lift_m : {0.001, 0.03}) {
    double before_rad = 0.0;
    for (double bent = 8.0; bent >= -6.0; bent -= 0.25) {
      INFO(bent);
      Frame frame = walk.source.frames[0];
      set_rotation(skeleton, leg.thigh, Eigen::Quaterniond::Identity(), frame);
      set_rotation(skeleton, leg.shin, axis_rotation(Axis::kX, bent * kDegree), frame);
      LegPose pose;
      legs.pose(frame, pose);
      const Eigen::Vector3d up_m = lift_m * Eigen::Vector3d::UnitY();
      const Reach bend = reach(skeleton, leg, pose, pose.point_from_root_m[0][kAnkle] + up_m);
      const Eigen::Vector3d turn_rad = rotation_log(bend.knee_turn);
      const double knee_rad = bent * kDegree + turn_rad.x();
      CHECK(turn_rad.x() > -1e-9);
      if (lift_m > 0.02) CHECK(knee_rad > 0.0);
      if (bent < 8.0) CHECK(std::abs(knee_rad - before_rad) < 2.0 * kDegree);
      before_rad = knee_rad;
    }
  }
}

TEST_CASE("an ankle that is out of reach is above its place; aside it stays towards it", "[feet]") {
  const auto walk = styled_walk(60.0, 0.1);
  const Skeleton& skeleton = *walk.source.skeleton;
  const Legs legs = Legs::find(skeleton).value();
  const Leg& leg = legs.leg(0);
  LegPose pose;
  legs.pose(walk.source.frames[0], pose);
  const Eigen::Vector3d hip_m = pose.from_root_m[static_cast<std::size_t>(leg.thigh)];
  const double far_m = 1.1 * legs.length_m();
  const auto reached = [&](const Eigen::Vector3d& to) -> Eigen::Vector3d {
    return reach(skeleton, leg, pose, hip_m + far_m * to.normalized()).ankle_m - hip_m;
  };
  const Eigen::Vector3d behind(0.0, -1.0, -0.4);
  CHECK(reached(behind).z() == Approx(far_m * behind.normalized().z()).margin(1e-3));
  CHECK(reached(behind).norm() == Approx(legs.length_m()).epsilon(0.02));
  const Eigen::Vector3d level(0.0, -0.1, 1.0);
  CHECK(reached(level).normalized().dot(level.normalized()) > 0.999);
}

TEST_CASE("the feet stage allocates nothing", "[feet][rt]") {
  const auto walk = styled_walk(120.0, 1.0);
  for (const char* root : {"off", "stride", "actor"}) {
    const auto stage = feet_stage(walk.source, root);
    test::LastFrame last;
    const std::uint64_t before = test::allocations();
    for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
      stage->process({.frame = walk.styled.frames[t], .input = &walk.source.frames[t]}, last);
    }
    CHECK(test::allocations() == before);
  }
}

TEST_CASE("the table names the roots; another word is refused", "[feet]") {
  const auto& table = feet_type().parameters;
  const ParameterSpec& root = table[test::parameter_index(feet_type(), "root")];
  CHECK(number_of(root, std::string("actor")) == static_cast<double>(RootMode::kActor));
  CHECK(display_text(root, 1.0) == "stride");
  CHECK_FALSE(takes_number(root, 3.0));
  CHECK_FALSE(takes_number(root, 0.5));
  const auto refused = complete_parameters(table, {{"root", std::string("walk")}});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.contains("must be off, stride or actor, not 'walk'"));
}

}  // namespace posed::feet
