#include "tests/bench/robot/figures.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <utility>

#include "models/robot/command.hpp"
#include "models/robot/hand_target.hpp"
#include "models/robot/pose_solver.hpp"
#include "proto/frame/degree.hpp"
#include "tests/bench/robot/dexpilot.hpp"
#include "tests/support/processor_time.hpp"

namespace posed::bench {
namespace {

using robot::Drive;

constexpr double kDt_s = 1.0 / kTakeRate_hz;
constexpr double kMargin_m = 1e-3;  // the stage's defaults
constexpr int kRounds = 2;
constexpr double kPinched_m = 15e-3;
constexpr double kStill_rad = 1.0 * kDegree;
constexpr int kHeld = static_cast<int>(0.2 * kTakeRate_hz);
constexpr double kLowPass = 0.2;
constexpr std::size_t kFirst = 60;  // the way from the start pose is no motion of the take's

struct Mean {
  double sum = 0.0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  [[nodiscard]] double value() const { return count == 0 ? std::nan("") : sum / count; }
};

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at =
      values.begin() + static_cast<long>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

bool is_still(const HandTake& take, int frame) {
  if (frame < kHeld) return false;
  const HandAngles& now = take.angles[static_cast<std::size_t>(frame)];
  for (int t = frame - kHeld; t < frame; ++t) {
    const HandAngles& then = take.angles[static_cast<std::size_t>(t)];
    for (std::size_t c = 0; c < now.size(); ++c) {
      if (std::abs(now[c] - then[c]) > kStill_rad) return false;
    }
  }
  return true;
}

// Limits, speed and jerk of the poses alone.
void judge_joints(const robot::RobotHand& robot, const std::vector<Drive>& poses,
                  RobotFigures& figures) {
  int beyond = 0;
  Mean jerk;
  for (std::size_t t = 0; t < poses.size(); ++t) {
    double by = 0.0;
    for (const robot::RobotJoint& joint : robot.joints) {
      const double angle = angle_of(joint, poses[t]);
      by = std::max({by, joint.low - angle, angle - joint.high});
    }
    beyond += by > 1e-5 ? 1 : 0;
    figures.beyond_rad = std::max(figures.beyond_rad, by);
    for (int i = 0; i < robot.size() && t >= kFirst; ++i) {
      const double speed = (poses[t][i] - poses[t - 1][i]) / kDt_s;
      figures.speed_rad_s = std::max(figures.speed_rad_s, std::abs(speed));
      const double third =
          poses[t][i] - 3.0 * (poses[t - 1][i] - poses[t - 2][i]) - poses[t - 3][i];
      jerk.add(third * third / std::pow(kDt_s, 6));
    }
  }
  figures.jerk_rad_s3 = std::sqrt(jerk.value());
  figures.beyond_percent = 100.0 * beyond / static_cast<double>(poses.size());
}

}  // namespace

std::array<RobotTrack, 2> our_tracks(const robot::RobotHand& robot, const HandTake& take) {
  const hand::HandGeometry person = hand::hand_geometry(default_hand_shape());
  RobotTrack pose, command;
  pose.name = "posed-pose";
  command.name = "posed-command";
  robot::HandTargets targets(robot, person);
  robot::HandTarget target;
  robot::PoseSolver solver(robot, kMargin_m);
  robot::Command follows(robot, kMargin_m);
  int stands = 0;
  for (const HandAngles& angles : take.angles) {
    const double start_us = test::processor_time_us();
    targets.find(angles, target);
    if (follows.blocked()) solver.restart(follows.pose());
    const Drive& wanted = solver.solve(target, kRounds);
    const double solved_us = test::processor_time_us();
    follows.follow(wanted, kDt_s);
    command.us.push_back(test::processor_time_us() - start_us);
    pose.us.push_back(solved_us - start_us);
    pose.poses.push_back(wanted);
    command.poses.push_back(follows.pose());
    const bool is_away = (wanted - follows.pose()).cwiseAbs().maxCoeff() > 3.0 * kDegree;
    stands = is_away && follows.velocity().cwiseAbs().maxCoeff() < 0.05 ? stands + 1 : 0;
    command.longest_stop_s = std::max(command.longest_stop_s, stands * kDt_s);
  }
  command.hard_stops = static_cast<int>(follows.hard_stops());
  return {pose, command};
}

std::array<RobotTrack, 2> rival_tracks(const robot::RobotHand& robot, const HandTake& take) {
  const hand::HandGeometry person = hand::hand_geometry(default_hand_shape());
  RobotTrack bare, filtered;
  bare.name = "DexPilot";
  filtered.name = "DexPilot-low-pass";
  DexPilot solver(robot, person);
  for (const HandAngles& angles : take.angles) {
    bare.us.push_back(test::timed_us([&] { bare.poses.push_back(solver.solve(angles)); }));
    const Drive& pose = bare.poses.back();
    const Drive before = filtered.poses.empty() ? pose : filtered.poses.back();
    filtered.poses.emplace_back(before + kLowPass * (pose - before));
  }
  filtered.us = bare.us;
  return {bare, filtered};
}

RobotFigures robot_figures(const robot::RobotHand& robot, const HandTake& take,
                           const RobotTrack& track) {
  RobotFigures figures;
  judge_joints(robot, track.poses, figures);
  const hand::HandGeometry person = hand::hand_geometry(default_hand_shape());
  robot::HandTargets targets(robot, person);
  robot::HandTarget target;
  robot::Placed placed(robot);
  robot::Gaps gaps;
  hand::HandPose hand;
  Mean pinch, held, direction, extension;
  int overlaps = 0;
  for (int t = 0; t < std::ssize(take.angles); ++t) {
    const HandAngles& angles = take.angles[static_cast<std::size_t>(t)];
    targets.find(angles, target);
    place(person, angles, hand);
    place(robot, track.poses[static_cast<std::size_t>(t)], placed);
    const bool still = is_still(take, t);
    double deepest_m = 0.0;
    for (const auto& gap : find_gaps(robot, placed, {}, false, gaps)) {
      deepest_m = std::min(deepest_m, gap.gap_m);
    }
    overlaps += deepest_m < -1e-5 ? 1 : 0;
    figures.overlap_mm = std::max(figures.overlap_mm, -1e3 * deepest_m);
    for (std::size_t f = 1; f < robot.fingers.size(); ++f) {
      const robot::Finger& finger = robot.fingers[f];
      const double gap_m = std::max(0.0, (hand.to_m[2] - hand.to_m[3 * finger.human + 2]).norm() -
                                             person.fingers[0].radius_m[2] -
                                             person.fingers[finger.human].radius_m[2]);
      const double ours_m = gap_of_tips(robot, placed, robot.fingers[0], finger).gap_m;
      if (gap_m < kPinched_m) {
        const double error_mm = 1e3 * std::abs(std::max(ours_m, 0.0) - gap_m);
        pinch.add(error_mm);
        if (still) held.add(error_mm);
      }
      if (target.pinch[f] > 0.0) continue;
      const Eigen::Vector3d wanted = target.tip_m[f] - finger.knuckle_m;
      const Eigen::Vector3d is = robot::tip_of(finger, placed) - placed.at_m[finger.knuckle];
      direction.add(std::atan2(wanted.cross(is).norm(), wanted.dot(is)) / kDegree);
      extension.add(100.0 * std::abs(is.norm() - wanted.norm()) / finger.length_m);
    }
  }
  figures.pinch_mm = pinch.value();
  figures.held_pinch_mm = held.value();
  figures.pinches = pinch.count;
  figures.held_pinches = held.count;
  figures.direction_deg = direction.value();
  figures.extension_percent = extension.value();
  figures.overlap_percent = 100.0 * overlaps / static_cast<double>(take.angles.size());
  figures.p50_us = percentile(track.us, 0.5);
  figures.p99_us = percentile(track.us, 0.99);
  return figures;
}

std::vector<double> joint_angles(const robot::RobotHand& robot, const Drive& pose) {
  std::vector<double> angles;
  for (const robot::RobotJoint& joint : robot.joints) angles.push_back(angle_of(joint, pose));
  return angles;
}

Result<> write_poses(const robot::RobotHand& robot, std::span<const Drive> poses,
                     const std::filesystem::path& path) {
  std::ofstream file(path);
  file << std::setprecision(9);
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    file << (j == 0 ? "" : ",") << robot.joints[j].name;
  }
  file << '\n';
  for (const Drive& pose : poses) {
    const char* comma = "";
    for (const double angle : joint_angles(robot, pose)) file << std::exchange(comma, ",") << angle;
    file << '\n';
  }
  file.flush();
  if (!file) return fail("cannot be written", path.string());
  return {};
}

}  // namespace posed::bench
