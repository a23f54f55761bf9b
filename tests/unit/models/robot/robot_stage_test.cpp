// The robot stage as its users see it: engaging, holding, stopping, pinching.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "models/hand/constraint_solver.hpp"
#include "models/robot/command.hpp"
#include "models/robot/hand_target.hpp"
#include "models/robot/pose_solver.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/hand_signs.hpp"
#include "tests/unit/models/robot/robot_rig.hpp"

namespace posed::robot {
namespace {

constexpr std::int64_t kStep_ns = 10'000'000;

double largest(const Frame& a, const Frame& b, std::size_t channels) {
  double most = 0.0;
  for (std::size_t j = 0; j < channels; ++j) {
    most = std::max(most, std::abs(static_cast<double>(a.angle_rad[j] - b.angle_rad[j])));
  }
  return most;
}

}  // namespace

TEST_CASE("a speed beyond the URDF's is said once, and one within it is not") {
  const auto said = [](double speed) {
    const test::RobotRig rig({{"speed", speed}});
    const auto notice = rig.stage->take_notice();
    if (!notice) return std::string();
    CHECK_FALSE(rig.stage->take_notice());
    return std::string(robot_type().notices.at(notice->index).sentence);
  };
  CHECK(said(8.0).empty());
  CHECK(said(20.0).find("its limits hold") != std::string::npos);
}

TEST_CASE("the robot's skeleton stands where its URDF says") {
  const test::RobotRig rig;
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  REQUIRE(rig.skeleton->joints.size() == hand.links.size());
  // No bones of a person, though its joints have their names.
  const auto has_bone = [](const Joint& joint) { return joint.bone.has_value(); };
  CHECK(std::ranges::none_of(rig.skeleton->joints, has_bone));
  Drive drive = hand.start();
  for (int i = 0; i < hand.size(); ++i) drive[i] = 0.3 * hand.driven[i].high;
  std::vector<double> values;
  for (const RobotJoint& joint : hand.joints) values.push_back(angle_of(joint, drive));
  Placed placed(hand.links.size());
  place(hand, drive, placed);
  std::vector<Eigen::Quaterniond> turn(hand.links.size());
  std::vector<Eigen::Vector3d> at(hand.links.size());
  for (std::size_t j = 0; j < hand.links.size(); ++j) {
    const Joint& joint = rig.skeleton->joints[j];
    turn[j] = local_rotation(*rig.skeleton, static_cast<int>(j), values);
    at[j] = joint.offset_m;
    if (joint.parent >= 0) {
      at[j] = at[joint.parent] + turn[joint.parent] * joint.offset_m;
      turn[j] = turn[joint.parent] * turn[j];
    }
    const Eigen::Vector3d& urdf_m = placed.at_m[j];  // x forwards, y left, z up
    CHECK((at[j] - Eigen::Vector3d(urdf_m.y(), urdf_m.z(), urdf_m.x())).norm() < 1e-9);
  }
}

TEST_CASE("a robot stands until it is engaged, and then leaves its place without a jump") {
  test::RobotRig rig;
  const std::size_t channels = rig.skeleton->channels.size();
  std::int64_t now_ns = kStep_ns;
  for (int i = 0; i < 20; ++i) rig.send(test::fist(1.0), now_ns += kStep_ns);
  CHECK(rig.last().robot == RobotState::kReleased);
  CHECK(largest(rig.last(), rig.out.frames.front(), channels) == 0.0);
  rig.engage();
  HandAngles lost = test::fist(1.0);
  lost[5] = std::nan("");
  rig.send(lost, now_ns += kStep_ns);
  CHECK(rig.last().robot == RobotState::kHolding);  // it is owed until the hand can be trusted
  for (int i = 0; i < 100; ++i) {
    const Frame before = rig.last();
    rig.send(test::fist(1.0), now_ns += kStep_ns);
    CHECK(rig.last().robot == RobotState::kEngaged);
    CHECK(largest(rig.last(), before, channels) <= 8.0 * 0.01 + 1e-6);
  }
  CHECK(largest(rig.last(), rig.out.frames.front(), channels) > 0.5);
  rig.send(test::fist(0.0), now_ns += kStep_ns);
  rig.release();
  const std::size_t released = rig.out.frames.size();
  for (int i = 0; i < 20; ++i) rig.send(test::fist(0.0), now_ns += kStep_ns);
  CHECK(rig.last().robot == RobotState::kReleased);
  // The last command is one at rest.
  const auto last = std::find_if(rig.out.frames.rbegin(), rig.out.frames.rend(),
                                 [](const Frame& f) { return f.robot != RobotState::kReleased; });
  CHECK(rig.out.frames.rend() - last > static_cast<std::ptrdiff_t>(released));
  for (const float velocity : last->velocity_rad_s) CHECK(velocity == 0.0F);
  const Frame stands = rig.last();
  rig.send(test::fist(0.5), now_ns += kStep_ns);
  CHECK(largest(rig.last(), stands, channels) == 0.0);
}

TEST_CASE("a robot brakes and holds when no frame of the hand comes") {
  test::RobotRig rig;
  std::int64_t now_ns = kStep_ns;
  rig.engage();
  for (int i = 0; i < 8; ++i) rig.send(test::fist(1.0), now_ns += kStep_ns);
  CHECK_FALSE(rig.stage->take_notice());
  REQUIRE(rig.stage->next_due_ns() == now_ns + 200'000'000);
  rig.tick_until(now_ns + 1'000'000'000);
  CHECK(rig.stage->next_due_ns() == kNoTime_ns);
  CHECK(rig.last().robot == RobotState::kHolding);
  for (const float velocity : rig.last().velocity_rad_s) CHECK(velocity == 0.0F);
  // 8 rad/s at 120 rad/s^2 are 67 ms.
  CHECK(rig.last().header.arrival_ns <= now_ns + 200'000'000 + 90'000'000);
  const auto notice = rig.stage->take_notice();
  REQUIRE(notice);
  CHECK(notice->index == 0);
  now_ns += 1'000'000'000;
  rig.send(test::fist(1.0), now_ns);
  CHECK(rig.last().robot == RobotState::kEngaged);
  // Whoever releases it while nothing comes is told so.
  rig.tick_until(now_ns + 1'000'000'000);
  rig.release();
  rig.tick_until(now_ns + 2'000'000'000);
  CHECK(rig.last().robot == RobotState::kReleased);
  CHECK(rig.stage->next_due_ns() == kNoTime_ns);
}

TEST_CASE("a robot's command is sent between the hand's frames where a rate is given") {
  test::RobotRig rig({{"rate_hz", 500.0}});
  rig.engage();
  rig.send(test::fist(1.0), kStep_ns);
  rig.send(test::fist(1.0), 2 * kStep_ns);
  const std::size_t before = rig.out.frames.size();
  rig.tick_until(3 * kStep_ns - 1);
  CHECK(rig.out.frames.size() - before == 4);
  CHECK(rig.last().quality == Quality::kPredicted);
  CHECK(rig.last().robot == RobotState::kEngaged);
}

TEST_CASE("frames that waited in a queue are no step back in time") {
  test::RobotRig rig({{"rate_hz", 500.0}});
  rig.engage();
  rig.send(test::fist(1.0), kStep_ns);
  rig.send(test::fist(1.0), 2 * kStep_ns);
  rig.tick_until(5 * kStep_ns);
  rig.send(test::fist(1.0), 3 * kStep_ns);
  CHECK(rig.last().robot == RobotState::kEngaged);
  CHECK_FALSE(rig.stage->take_notice());
  rig.send(test::fist(1.0), 2 * kStep_ns);
  CHECK(rig.last().robot == RobotState::kHolding);
}

TEST_CASE("a robot stage does not allocate") {
  test::RobotRig rig({{"rate_hz", 500.0}});
  rig.engage();
  rig.out.frames.reserve(500);
  std::int64_t now_ns = kStep_ns;
  rig.send(test::fist(1.0), now_ns);
  const std::uint64_t before = test::allocations();
  for (int i = 0; i < 30; ++i) {
    HandAngles angles = test::fist(i % 2);
    angles[0] = 0.02 * i;
    rig.send(angles, now_ns += kStep_ns);
    rig.tick_until(now_ns + kStep_ns - 1);
  }
  rig.tick_until(now_ns + 1'000'000'000);
  CHECK(test::allocations() == before);
}

TEST_CASE("a robot's finger and thumb meet where the hand's do") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand robot = robot_hand(std::move(urdf), {}, "mitten").value();
  const hand::HandGeometry person = hand::hand_geometry(default_hand_shape());
  HandTargets targets(robot, person);
  PoseSolver solver(robot, 1e-3);
  HandTarget target;
  targets.find(test::fist(0.2), target);
  // The two fingers nearest to the thumb, at a person's gap of nothing.
  for (const std::size_t f : {1U, 2U}) {
    target.pinch = {};
    target.tip_weight.fill(1.0);
    target.pinch[f] = 1.0;
    target.gap_m[f] = 0.0;
    target.direction[f] = Eigen::Vector3d(0.5, 0.5, -0.7).normalized();
    target.tip_weight[0] = target.tip_weight[f] = 0.1;
    target.tip_m[f] = robot.fingers[f].knuckle_m + Eigen::Vector3d(0.06, 0.0, 0.035);
    target.tip_m[0] = target.tip_m[f];
    for (int i = 0; i < 60; ++i) solver.solve(target, 2);
    Placed placed(robot);
    place(robot, solver.pose(), placed);
    const double gap_m =
        gap_between(robot, placed, robot.fingers[0].last, robot.fingers[f].last).gap_m;
    CHECK(gap_m >= 0.0);
    CHECK(gap_m < 3e-3);
  }
}

TEST_CASE("a solver's pose keeps the margin that the command keeps") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand robot = robot_hand(std::move(urdf), {}, "mitten").value();
  HandTargets targets(robot, hand::hand_geometry(default_hand_shape()));
  PoseSolver solver(robot, 1e-3);
  Placed placed(robot);
  Gaps gaps;
  HandTarget target;
  int nearer = 0;
  // Whatever hands: fingers through each other, the thumb in the palm.
  for (int number = 0; number < 60; ++number) {
    HandAngles angles{};
    for (std::size_t c = 0; c < angles.size(); ++c) {
      angles[c] =
          3.0 * std::fmod((number + 1) * std::sqrt(2.0 + 3.0 * static_cast<double>(c)), 1.0) - 1.5;
    }
    targets.find(angles, target);
    for (int i = 0; i < 40; ++i) solver.solve(target, 2);
    place(robot, solver.pose(), placed);
    double least_m = 1.0;
    for (const Gap& gap : find_gaps(robot, placed, {.most_m = 1e-3}, false, gaps)) {
      least_m = std::min(least_m, gap.gap_m);
    }
    nearer += least_m < 0.8e-3 ? 1 : 0;
  }
  CHECK(nearer == 0);
}

// LEAP's links have edges: where rows kept only their nearest points apart, a thumb stood still for
// twelve seconds of these signs.
TEST_CASE("a robot's hand follows from sign to sign") {
  const auto robots = test::shared("data/robots/leap_hand");
  const auto signs = test::shared("data/gloves/libras_cyberglove");
  if (!robots || !signs) SKIP_WITHOUT_SHARED();
  const std::string path = (*robots / "leap_hand_right.urdf").string();
  auto urdf = parse_urdf(load_urdf(path).value(), path).value();
  const RobotHand robot = robot_hand(std::move(urdf), {}, path).value();
  HandTargets targets(robot, hand::hand_geometry(default_hand_shape()));
  PoseSolver solver(robot, 1e-3);
  hand::ConstraintSolver constrain;
  HandAngles variance;
  variance.fill(1.0);
  HandAngles from{};
  int stood = 0, moved = 0;
  for (const test::ThumbSign& sign : test::kThumbSigns) {
    for (const HandAngles& to : test::sign_poses(*signs, sign.name)) {
      const Drive before = solver.pose();
      constexpr int kMove = 60, kHold = 60;
      for (int t = 1; t <= kMove + kHold; ++t) {
        const double share = std::min(1.0, static_cast<double>(t) / kMove);
        HandAngles angles;
        for (std::size_t c = 0; c < angles.size(); ++c) {
          angles[c] = from[c] + share * (to[c] - from[c]);
        }
        constrain.step(angles, variance);
        HandTarget target;
        targets.find(angles, target);
        solver.solve(target, 2);
      }
      double turned = 0.0;
      for (std::size_t c = 0; c < to.size(); ++c)
        turned = std::max(turned, std::abs(to[c] - from[c]));
      from = to;
      if (turned < 0.3) continue;
      ++moved;
      stood += (solver.pose() - before).cwiseAbs().maxCoeff() < 0.02 ? 1 : 0;
    }
  }
  CHECK(moved > 30);
  CHECK(stood == 0);
}

TEST_CASE("a command that links stop is counted once, names them, and lets go of the pose") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand robot = robot_hand(std::move(urdf), {}, "mitten").value();
  Command command(robot, 1e-3);
  Placed placed(robot);
  Gaps gaps;
  int blocked_poses = 0;
  for (int number = 0; number < 40; ++number) {
    Drive wanted = Drive::Zero();
    for (int i = 0; i < robot.size(); ++i) {
      const double share = std::fmod((number + 1) * std::sqrt(2.0 + 3.0 * i), 1.0);
      wanted[i] = robot.driven[i].low + share * (robot.driven[i].high - robot.driven[i].low);
    }
    const std::uint64_t before = command.stops();
    int times = 0;
    for (int t = 0; t < 300; ++t) {
      command.follow(wanted, 0.01);
      times += command.blocked() ? 1 : 0;
    }
    const double away = (wanted - command.pose()).cwiseAbs().maxCoeff();
    CHECK((away < 0.05 || command.stops() > before));
    if (times < 10) continue;
    ++blocked_poses;
    // It stands for seconds: told again and again, counted when it came to that.
    CHECK(command.stops() - before < static_cast<std::uint64_t>(times));
    const auto [a, b] = command.in_the_way();
    place(robot, command.pose(), placed);
    CHECK(gap_between(robot, placed, a, b).gap_m < 2e-3);
  }
  CHECK(blocked_poses > 0);
  CHECK(command.limited() > command.stops());
}

TEST_CASE("a robot stage says what it cannot serve") {
  const StageType& type = robot_type();
  Parameters parameters = complete_parameters(type.parameters, {{"urdf", test::mitten()}}).value();
  REQUIRE(type.read_files(parameters));
  Skeleton person;
  person.name = "person";
  person.joints.emplace_back().name = "hips";
  REQUIRE(person.finish());
  const auto words = [&](const StageContext& context) {
    const auto made = type.make(context, nullptr);
    return made ? std::string() : made.error().message;
  };
  CHECK(words({.skeleton = std::make_shared<const Skeleton>(person), .parameters = parameters})
            .find("only hands") != std::string::npos);
  const auto left = std::make_shared<const Skeleton>(hand_skeleton(Side::kLeft));
  CHECK(words({.skeleton = left, .parameters = parameters}).find("a right hand") !=
        std::string::npos);
  parameters["side"] = std::string("right");
  CHECK(words({.skeleton = left, .parameters = parameters}).empty());
  parameters["hold"] = std::string("index_flex=9");
  CHECK(words({.skeleton = left, .parameters = parameters}).find("beyond its limits") !=
        std::string::npos);
  parameters["hold"] = std::string("nothing=0");
  CHECK(words({.skeleton = left, .parameters = parameters}).find("no joint and angle") !=
        std::string::npos);
}

}  // namespace posed::robot
