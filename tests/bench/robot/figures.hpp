// How well a robot hand follows takes of hands, by posed and by its rival on the same frames. All
// are judged by the same capsules and definitions. Cold.
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "models/robot/robot_hand.hpp"
#include "tests/bench/robot/take.hpp"

namespace posed::bench {

// Poses of the robot at the take's rate, one a frame.
struct RobotTrack {
  std::string name;
  std::vector<robot::Drive> poses;
  std::vector<double> us;  // CPU time of each frame
  int hard_stops = 0;
  double longest_stop_s = 0.0;  // it stood though a joint was more than 3 degrees from the pose
};

struct RobotFigures {
  // Mean error of the gap between the surfaces of thumb and finger where the person's is below 15
  // mm; where links overlap they count as touching. Held: where the hand has stood for 0.2 s.
  double pinch_mm = 0.0, held_pinch_mm = 0.0;
  int pinches = 0, held_pinches = 0;
  // Knuckle to tip of fingers that do not pinch: mean angle to the person's, mean error of length.
  double direction_deg = 0.0, extension_percent = 0.0;
  double beyond_percent = 0.0, beyond_rad = 0.0;   // frames beyond a limit, followers too
  double overlap_percent = 0.0, overlap_mm = 0.0;  // frames with links in each other
  double speed_rad_s = 0.0, jerk_rad_s3 = 0.0;     // the fastest; rms
  double p50_us = 0.0, p99_us = 0.0;
};

// posed's pose without speeds, and its command.
std::array<RobotTrack, 2> our_tracks(const robot::RobotHand& robot, const HandTake& take);
// DexPilot as it is, and with its low-pass.
std::array<RobotTrack, 2> rival_tracks(const robot::RobotHand& robot, const HandTake& take);

RobotFigures robot_figures(const robot::RobotHand& robot, const HandTake& take,
                           const RobotTrack& track);

// The angles of the joints that turn, in the robot's order.
std::vector<double> joint_angles(const robot::RobotHand& robot, const robot::Drive& pose);
// A column a joint, a line a frame: what posed_robot_judge reads.
Result<> write_poses(const robot::RobotHand& robot, std::span<const robot::Drive> poses,
                     const std::filesystem::path& path);

}  // namespace posed::bench
