// RobotJudge: what MuJoCo sees of a robot hand's poses, with the real shapes of its URDF: links
// that go into each other, and joints beyond their limits. It shares no code with what computes
// poses.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>

#include "proto/frame/result.hpp"

namespace posed::test {

// Positions of joints [rad, m], a row for each frame.
struct RobotPoses {
  std::vector<std::string> joints;        // a column each
  std::vector<std::vector<double>> rows;  // [frame][column]
};
// A line of names, then a line of numbers for each frame; with commas.
Result<RobotPoses> read_robot_poses(const std::filesystem::path& path);

struct RobotVerdict {
  struct Place {
    int frames = 0;
    double worst = 0.0;  // depth [m], or how far beyond the limit [rad, m]
  };
  int frames = 0, in_contact = 0, beyond_limits = 0;
  std::map<std::pair<std::string, std::string>, Place> contacts;  // [links]
  std::map<std::string, Place> limits;                            // [joint]
  std::vector<std::string> unknown_columns, still_joints;  // not of the hand; driven, no column
};

// One thread.
class RobotJudge {
 public:
  static constexpr double kDepth_m = 0.001;  // less is no contact
  static constexpr double kBeyond = 1e-5;    // [rad, m]; less is rounding

  // Errors are MuJoCo's.
  static Result<RobotJudge> load(const std::filesystem::path& urdf);

  // Followers (mimic) are computed from their leaders, whatever their column says. A joint without
  // a column stays where it starts: at zero, or at the nearest limit. Links that touch there, or
  // that a joint connects, are not judged.
  [[nodiscard]] RobotVerdict judge(const RobotPoses& poses);

  [[nodiscard]] int joints() const { return model_->njnt; }
  [[nodiscard]] int links() const { return links_; }
  [[nodiscard]] const std::vector<std::string>& without_shape() const { return without_shape_; }
  [[nodiscard]] const std::vector<std::string>& missing_meshes() const { return missing_; }
  [[nodiscard]] std::vector<std::string> touching_at_start() const;

 private:
  using Pair = std::pair<int, int>;  // bodies, the smaller first
  struct Follower {
    int joint, leader;
    double multiplier, offset;
  };
  struct Prepared;
  RobotJudge() = default;
  static Result<Prepared> prepare(const std::filesystem::path& urdf);
  Result<> find_followers(const std::vector<std::vector<std::string>>& mimics);
  void set_pose(const std::map<int, double>& values);
  [[nodiscard]] std::map<Pair, double> contacts();
  void judge_limits(bool numbers, RobotVerdict& verdict) const;
  [[nodiscard]] double start_of(int joint) const;
  [[nodiscard]] std::string link_name(int body) const;

  std::unique_ptr<mjModel, void (*)(mjModel*)> model_{nullptr, nullptr};
  std::unique_ptr<mjData, void (*)(mjData*)> data_{nullptr, nullptr};
  std::string root_;  // the link that MuJoCo calls the world
  int links_ = 0;
  std::vector<std::string> without_shape_, missing_;
  std::vector<Follower> followers_;  // leaders first
  std::set<Pair> at_start_;
};

}  // namespace posed::test
