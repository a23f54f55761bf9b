// posed_bench robot: how well, how smoothly and at what cost a robot hand follows takes of hands,
// beside DexPilot on the same frames.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/robot/figures.hpp"

namespace posed::bench {
namespace {

constexpr const char* kBenchRobotFooter =
    R"(Without a take, a made-up hand pinches, points and makes fists. Takes run at 120
frames a second, each a command. "Pose" is without speeds; the command keeps 8 rad/s, or what the
URDF says where that is less, and 120 rad/s^2. Gaps are those of capsules that hold the robot's
shapes; a mean that has nothing to average is a dash. CPU time needs a build with -O2.

  posed_bench robot config/robots/mitten.urdf
  posed_bench robot hand.urdf take.csv --out poses    # the commands, judged by MuJoCo:
  posed_robot_judge hand.urdf poses/posed-command.csv)";

struct BenchRobotOptions {
  std::string urdf, take, signs, out;
  double speed = 0.0;
};

Result<HandTake> take_of(const BenchRobotOptions& options) {
  if (!options.signs.empty()) return signs_take(options.signs);
  if (!options.take.empty()) return read_take(options.take);
  return synthetic_take();
}

void print_row(const char* name, const std::vector<RobotFigures>& all, double RobotFigures::* value,
               int decimals) {
  std::printf("%-38s", name);
  for (const RobotFigures& one : all) {
    if (std::isnan(one.*value)) {
      std::printf(" %18s", "-");
    } else {
      std::printf(" %18.*f", decimals, one.*value);
    }
  }
  std::printf("\n");
}

void print_figures(const std::vector<RobotTrack>& tracks, const std::vector<RobotFigures>& all) {
  std::printf("%-38s", "");
  for (const RobotTrack& track : tracks) std::printf(" %18s", track.name.c_str());
  std::printf("\n");
  print_row("pinch error, mm", all, &RobotFigures::pinch_mm, 1);
  print_row("pinch error, held 0.2 s, mm", all, &RobotFigures::held_pinch_mm, 1);
  print_row("direction error, deg", all, &RobotFigures::direction_deg, 1);
  print_row("extension error, %", all, &RobotFigures::extension_percent, 1);
  print_row("frames beyond a joint's limit, %", all, &RobotFigures::beyond_percent, 1);
  print_row("  farthest, rad", all, &RobotFigures::beyond_rad, 4);
  print_row("frames with capsules in each other, %", all, &RobotFigures::overlap_percent, 1);
  print_row("  deepest, mm", all, &RobotFigures::overlap_mm, 1);
  print_row("fastest joint, rad/s", all, &RobotFigures::speed_rad_s, 1);
  print_row("jerk, rms, rad/s^3", all, &RobotFigures::jerk_rad_s3, 0);
  print_row("CPU p50, us a frame", all, &RobotFigures::p50_us, 0);
  print_row("CPU p99, us a frame", all, &RobotFigures::p99_us, 0);
}

Result<> bench(const BenchRobotOptions& options) {
  const auto text = TRY(robot::load_urdf(options.urdf));
  auto urdf = TRY(robot::parse_urdf(text, options.urdf));
  // Often a URDF's speeds are none of the robot's: here they may be exceeded.
  for (robot::Link& link : urdf.links) link.speed = std::max(link.speed, options.speed);
  const auto robot =
      TRY(robot::robot_hand(std::move(urdf), {.speed = options.speed}, options.urdf));
  const auto take = TRY(take_of(options));
  std::vector<RobotTrack> tracks;
  for (const RobotTrack& track : our_tracks(robot, take)) tracks.push_back(track);
  for (const RobotTrack& track : rival_tracks(robot, take)) tracks.push_back(track);
  std::vector<RobotFigures> all;
  for (const RobotTrack& track : tracks) all.push_back(robot_figures(robot, take, track));
  std::printf("%s, %d joints driven, %zu capsules, %zu pairs of links; %s, %zu frames, ",
              robot.name.c_str(), robot.size(), robot.capsules.size(), robot.pairs.size(),
              take.name.c_str(), take.angles.size());
  std::printf("%d of thumb and finger near each other, %d held\n", all[0].pinches,
              all[0].held_pinches);
  print_figures(tracks, all);
  std::printf("the command: %d hard stops, the longest stop %.3f s\n", tracks[1].hard_stops,
              tracks[1].longest_stop_s);
  if (options.out.empty()) return {};
  const std::filesystem::path folder(options.out);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  for (const RobotTrack& track : tracks) {
    TRY(write_poses(robot, track.poses, folder / (track.name + ".csv")));
  }
  return {};
}

}  // namespace

void add_bench_robot(CLI::App& bench_app, int& exit_code) {
  const auto options = std::make_shared<BenchRobotOptions>();
  CLI::App* command =
      bench_app.add_subcommand("robot", "A robot hand follows takes of hands, beside DexPilot");
  command->footer(kBenchRobotFooter);
  command->add_option("HAND", options->urdf, "The robot hand (.urdf)")->required();
  CLI::Option* take = command->add_option("TAKE", options->take, "A hand's motion");
  command->add_option("--signs", options->signs, "A folder of signs of LIBRAS instead")
      ->excludes(take);
  command->add_option("--speed", options->speed, "Of each joint, rad/s, though the URDF says less")
      ->check(CLI::Range(0.0, 100.0));
  command->add_option("--out", options->out, "A folder for the poses of each, a column a joint");
  command->callback([options, &exit_code] { exit_code = tools::report(bench(*options)); });
}

}  // namespace posed::bench
