// Whatever comes in, what goes out keeps the limits of position, speed and acceleration.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "models/robot/command.hpp"
#include "models/robot/pose_solver.hpp"
#include "proto/frame/degree.hpp"
#include "tests/unit/models/robot/robot_rig.hpp"

namespace posed::robot {
namespace {

constexpr double kSpeed = 8.0;
constexpr double kAcceleration = 120.0;

struct Broken {
  int position = 0, speed = 0, acceleration = 0, jump = 0;
  [[nodiscard]] int all() const { return position + speed + acceleration + jump; }
};

// Judges the frames alone. `a` of what is allowed: below 1 the judge must find something.
Broken judge(const Skeleton& skeleton, const std::vector<Frame>& frames, double a = 1.0) {
  Broken broken;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    for (std::size_t j = 0; j < skeleton.channels.size(); ++j) {
      const float angle = frame.angle_rad[j];
      const double speed = std::abs(static_cast<double>(frame.velocity_rad_s[j]));
      if (!(angle >= skeleton.channels[j].min && angle <= skeleton.channels[j].max)) {
        ++broken.position;
      }
      if (!(speed <= a * kSpeed)) ++broken.speed;
      if (i == 0) continue;
      const Frame& before = frames[i - 1];
      const double dt_s = std::max(
          0.0, 1e-9 * static_cast<double>(frame.header.arrival_ns - before.header.arrival_ns));
      const double moved = std::abs(static_cast<double>(angle - before.angle_rad[j]));
      if (moved > a * kSpeed * dt_s + 1e-6) ++broken.jump;
      const double faster =
          std::abs(static_cast<double>(frame.velocity_rad_s[j] - before.velocity_rad_s[j]));
      if (faster > a * kAcceleration * dt_s + 1e-4) ++broken.acceleration;
    }
  }
  return broken;
}

HandAngles random_hand(std::mt19937_64& random) {
  HandAngles angles;
  const double width = std::uniform_int_distribution<int>(0, 3)(random) == 0 ? 10.0 : 1.5;
  for (double& angle : angles)
    angle = std::uniform_real_distribution<double>(-width, width)(random);
  if (std::uniform_int_distribution<int>(0, 20)(random) == 0) {
    angles[std::uniform_int_distribution<std::size_t>(0, 44)(random)] = std::nan("");
  }
  return angles;
}

}  // namespace

TEST_CASE("no input takes a robot's command beyond its limits") {
  std::uint64_t hard = 0;
  for (unsigned seed = 0; seed < 4; ++seed) {
    INFO("seed " << seed);
    std::mt19937_64 random(seed);
    // No two links can touch where none has a shape, so that no stop is hard.
    Parameters parameters{{"acceleration", kAcceleration},
                          {"rate_hz", seed % 3 == 0 ? 250.0 : 0.0}};
    test::RobotRig rig(parameters);
    std::int64_t now_ns = 1'000'000'000;
    HandAngles angles{};
    bool notices = false;
    for (int i = 0; i < 250; ++i) {
      const int kind = std::uniform_int_distribution<int>(0, 30)(random);
      if (kind == 0) rig.engage();
      if (kind == 1 && i > 125) rig.release();
      std::int64_t step_ns = 10'000'000;
      if (kind < 6) step_ns = 1'000'000;
      if (kind == 7) step_ns = -50'000'000;
      if (kind == 8) step_ns = 10'000'000'000;
      if (kind == 9) step_ns = 100;
      if (kind == 10) step_ns = -5'000'000'000;
      if (step_ns > 0) rig.tick_until(now_ns + step_ns - 1);
      now_ns += step_ns;
      if (kind > 20) angles = random_hand(random);
      rig.send(angles, now_ns, kind == 11 ? Quality::kStale : Quality::kMeasured);
      while (const auto notice = rig.stage->take_notice()) {
        notices = true;
        if (notice->index == 3) ++hard;
      }
    }
    const Broken broken = judge(*rig.skeleton, rig.out.frames);
    CHECK(broken.position == 0);
    CHECK(broken.speed == 0);
    CHECK(broken.jump == 0);
    // Links that would have met are stopped at once; that has the higher right.
    if (hard == 0) CHECK(broken.acceleration == 0);
    CHECK(notices);
    // The judge sees a robot that is allowed less.
    CHECK(judge(*rig.skeleton, rig.out.frames, 0.5).all() > 0);
  }
  WARN("hard stops were told " << hard << " times");
}

TEST_CASE("a command without links that meet keeps its accelerations at any times") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  for (Link& link : urdf.links) link.shapes.clear();
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  Command command(hand, 1e-3);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Drive wanted = hand.start();
  int broken = 0;
  for (int i = 0; i < 6000; ++i) {
    const Drive before = command.velocity();
    const Drive from = command.pose();
    if (share(random) < 0.05) {
      for (int d = 0; d < hand.size(); ++d) wanted[d] = 4.0 * (2.0 * share(random) - 1.0);
    }
    const double dt_s = std::pow(10.0, -6.0 + 5.0 * share(random));
    if (share(random) < 0.1) {
      command.brake(dt_s);
    } else {
      command.follow(wanted, dt_s);
    }
    for (int d = 0; d < hand.size(); ++d) {
      const DrivenJoint& joint = hand.driven[d];
      const double speed = command.velocity()[d];
      const bool kept = command.pose()[d] >= joint.low && command.pose()[d] <= joint.high &&
                        std::abs(speed) <= joint.speed &&
                        std::abs(speed - before[d]) <= joint.acceleration * dt_s + 1e-9 &&
                        std::abs(command.pose()[d] - from[d]) <= joint.speed * dt_s;
      if (!kept) ++broken;
    }
  }
  CHECK(broken == 0);
  CHECK(command.hard_stops() == 0);
}

TEST_CASE("links of a robot stay apart, whatever pose is wanted") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  Command command(hand, 1e-3);
  Placed placed(hand);
  Gaps gaps;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Drive wanted = hand.start();
  int wanted_overlaps = 0;
  double deepest_m = 0.0;
  for (int i = 0; i < 1200; ++i) {
    if (i % 40 == 0) {
      for (int d = 0; d < hand.size(); ++d) {
        wanted[d] = hand.driven[d].low + share(random) * (hand.driven[d].high - hand.driven[d].low);
      }
      place(hand, wanted, placed);
      wanted_overlaps += find_gaps(hand, placed, {}, false, gaps).empty() ? 0 : 1;
    }
    command.follow(wanted, 1.0 / 120.0);
    place(hand, command.pose(), placed);
    for (const Gap& gap : find_gaps(hand, placed, {}, false, gaps)) {
      deepest_m = std::min(deepest_m, gap.gap_m);
    }
  }
  CHECK(wanted_overlaps > 5);  // else the test says nothing
  CHECK(deepest_m >= -1e-5);
  WARN("hard stops at " << command.hard_stops() << " of 1200 ticks");
  CHECK(command.hard_stops() < 60);
}

TEST_CASE("gaps that are found on the way are those of a first look") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  Placed on_the_way(hand);
  Gaps gaps, first_gaps, there_gaps;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Drive pose = hand.start();
  int other = 0, compared = 0, unforeseen = 0;
  for (int i = 0; i < 300; ++i) {
    const double step = std::pow(10.0, -4.0 + 4.0 * share(random));
    Drive turn = Drive::Zero(), there = pose;
    for (int d = 0; d < hand.size(); ++d) {
      const DrivenJoint& joint = hand.driven[d];
      pose[d] = std::clamp(pose[d] + step * (2.0 * share(random) - 1.0), joint.low, joint.high);
      turn[d] = 0.1 * share(random);
      there[d] = pose[d] + turn[d] * (2.0 * share(random) - 1.0);
    }
    const Near near{.most_m = i % 3 == 0 ? 1e-3 : 0.03};
    place(hand, pose, on_the_way);
    const auto found = find_gaps(hand, on_the_way, near, false, gaps);
    Placed fresh(hand);
    place(hand, pose, fresh);
    const auto first = find_gaps(hand, fresh, near, false, first_gaps);
    compared += static_cast<int>(first.size());
    other +=
        std::ranges::equal(found, first,
                           [](const Gap& a, const Gap& b) {
                             return a.a == b.a && a.b == b.b && std::abs(a.gap_m - b.gap_m) < 1e-12;
                           })
            ? 0
            : 1;
    // What the turns can bring near is among what is near by them.
    const auto may = find_gaps(hand, on_the_way, {.most_m = 1.0, .turn = &turn}, false, gaps);
    place(hand, there, fresh);
    for (const Gap& gap : find_gaps(hand, fresh, {}, false, there_gaps)) {
      const bool foreseen = std::ranges::any_of(
          may, [&](const Gap& one) { return one.a == gap.a && one.b == gap.b; });
      if (!foreseen && may.size() < gaps.size()) ++unforeseen;
    }
  }
  CHECK(compared > 300);  // else the test says nothing
  CHECK(other == 0);
  CHECK(unforeseen == 0);
}

}  // namespace posed::robot
