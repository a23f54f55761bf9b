// The score of a styled walk in cases where it is known in advance, and where none is defined.
#include "models/style/judge/evaluate.hpp"

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"

using namespace posed;
using motion::make_walker;
using motion::WalkerFamily;

TEST_CASE("a walk left alone scores one, the target's own walk scores zero", "[style][evaluate]") {
  const auto march = make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  const auto sway = make_walker({.family = WalkerFamily::kSway, .person = 1}).value();
  const auto alone = style::evaluate_style(march, march, sway);
  REQUIRE(alone);
  CHECK(alone->cycle_ratio == 1.0);
  CHECK(alone->ratio == 1.0);
  CHECK(alone->jerk_ratio == 1.0);
  CHECK(alone->component_rms_deg == 0.0);
  const auto reached = style::evaluate_style(march, sway, sway);
  REQUIRE(reached);
  CHECK(reached->cycle_ratio == Approx(0.0).margin(1e-9));
  CHECK(reached->component_rms_deg > 1.0);
  // Seen from outside: the target's own walk differs from it by nothing, and the march by much more
  // than the halves of a walk from each other.
  REQUIRE(reached->body);
  REQUIRE(reached->body->floor);
  const auto& [source, styled, floor, leg_m] = *reached->body;
  CHECK(styled.tempo == 0.0);
  CHECK(leg_m > 0.6);
  CHECK(styled.direction_rad < 0.02);
  CHECK(styled.height < 0.002);
  CHECK(source.direction_rad > 0.15);
  CHECK(source.direction_rad > 3.0 * floor->direction_rad);
  CHECK(source.height > 2.0 * floor->height);
  CHECK(alone->body->styled.speed_s == alone->body->source.speed_s);
}

TEST_CASE(
    "a walker who was not taught misses all of a style that it does not get, and none of one"
    " that it gets",
    "[style][evaluate]") {
  const auto walk = [](WalkerFamily family, std::uint32_t person) {
    return motion::motion_of(make_walker({.family = family, .person = person}).value()).value();
  };
  const auto march = walk(WalkerFamily::kMarch, 1);
  const auto sway = walk(WalkerFamily::kSway, 1);
  const auto stranger = walk(WalkerFamily::kMarch, 2);
  const auto nothing = style::arrival(stranger, stranger, march, sway);
  REQUIRE(nothing);
  CHECK(nothing->missing == Approx(1.0));
  CHECK(nothing->arms_rad == Approx(nothing->unstyled_arms_rad));
  CHECK(nothing->lean_rad == Approx(nothing->unstyled_lean_rad));
  CHECK(nothing->worst_arm_rad > nothing->arms_rad);
  REQUIRE(nothing->floor);
  CHECK(*nothing->floor < 0.3);
  // An arm that is held another way.
  auto clip = make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  for (std::size_t c = 0; c < clip.skeleton->channels.size(); ++c) {
    const Channel& channel = clip.skeleton->channels[c];
    if (channel.translation || channel.joint != clip.skeleton->joint_of(Bone::kLeftUpperArm)) {
      continue;
    }
    clip.channels.col(static_cast<Eigen::Index>(c)).array() += 0.3;
  }
  const auto held = motion::motion_of(clip).value();
  const auto all = style::arrival(march, held, march, held);
  REQUIRE(all);
  CHECK(all->missing < 1e-6);
  CHECK(all->arms_rad < 1e-6);
  CHECK(all->unstyled_arms_rad > 0.1);
}

TEST_CASE("a target that is the source itself, or a source that stands still, has no score",
          "[style][evaluate]") {
  auto march = make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  const auto sway = make_walker({.family = WalkerFamily::kSway, .person = 1}).value();
  march.path = "march.bvh";
  const auto same = style::evaluate_style(march, sway, march);
  REQUIRE_FALSE(same);
  CHECK(same.error().message.find("walks as the source does already") != std::string::npos);
  CHECK(same.error().file == "march.bvh");

  auto still = march;
  still.path = "still.bvh";
  still.channels.rowwise() = march.channels.row(0).eval();
  const auto held = style::evaluate_style(still, still, sway);
  REQUIRE_FALSE(held);
  CHECK(held.error().message.find("does not move") != std::string::npos);
  CHECK(held.error().file == "still.bvh");
}

TEST_CASE("a model of the canonical skeleton is compared on a target with other joint names",
          "[style][evaluate]") {
  const auto march = make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  auto sway = make_walker({.family = WalkerFamily::kSway, .person = 1}).value();
  auto renamed = std::make_shared<Skeleton>(*sway.skeleton);
  for (Joint& joint : renamed->joints) joint.name = "my_" + joint.name;
  sway.skeleton = renamed;
  sway.path = "sway.bvh";
  const auto native = style::evaluate_style(march, march, sway);
  REQUIRE_FALSE(native);
  CHECK(native.error().message.contains("pose space, native"));
  CHECK(native.error().message.contains("my_"));
  const auto space = motion::describe_space(motion::Space::kHumanoid, *march.skeleton).value();
  const auto alone = style::evaluate_style(march, march, sway, space);
  REQUIRE(alone);
  CHECK(alone->cycle_ratio == 1.0);
  CHECK(alone->source_component_rms_deg > 1.0);
}
