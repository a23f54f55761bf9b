// Command: the pose that the robot is told, moved towards a wanted one within all limits.
//
// Rights, the higher first: joint limit, no new penetration, acceleration, speed, target. Position,
// speed and gaps hold for every input. Acceleration holds unless links would else meet; each tick
// at which it did not is counted. RT-safe, no heap.
#pragma once

#include "models/robot/shapes.hpp"
#include "models/robot/step_program.hpp"

namespace posed::robot {

class Command {
 public:
  // `robot` must outlive it. At its start pose, at rest.
  Command(const RobotHand& robot, double margin_m);

  // The command `dt_s` later, on its way to `wanted`; at most 0.1 s, and nothing for 0 or less.
  RT_SAFE void follow(const Drive& wanted, double dt_s) noexcept;
  // The same on its way to a stand.
  RT_SAFE void brake(double dt_s) noexcept;

  [[nodiscard]] const Drive& pose() const noexcept { return pose_; }          // rad
  [[nodiscard]] const Drive& velocity() const noexcept { return velocity_; }  // rad/s
  [[nodiscard]] bool stands() const noexcept { return velocity_.isZero(0.0); }
  // Commands that links in the way changed, and those that kept them apart only beyond the
  // acceleration.
  [[nodiscard]] std::uint64_t limited() const noexcept { return limited_; }
  [[nodiscard]] std::uint64_t hard_stops() const noexcept { return hard_stops_; }
  // How often it came to a stand away from the wanted pose, because links were in the way.
  [[nodiscard]] std::uint64_t stops() const noexcept { return stops_; }
  // So it stands now: whoever wants the pose should look for one that can be reached from here.
  [[nodiscard]] bool blocked() const noexcept { return blocked_s_ >= kBlocked_s; }
  // The links that kept the latest command most from where it went; -1: none have yet.
  [[nodiscard]] std::pair<int, int> in_the_way() const noexcept { return in_the_way_; }
  [[nodiscard]] bool in_contact() const noexcept { return in_contact_; }

 private:
  static constexpr double kBlocked_s = 0.05;

  RT_SAFE void find_blocked(const Drive& wanted, double dt_s) noexcept;
  RT_SAFE void find_box(double dt_s) noexcept;
  RT_SAFE void move(const Drive& aim, double dt_s) noexcept;
  RT_SAFE void find_rows(std::span<const Gap> gaps, double margin_m, double dt_s) noexcept;
  RT_SAFE bool keep_apart(std::span<const Gap> gaps, const Drive& aim, double dt_s,
                          Drive& step) noexcept;
  RT_SAFE void find_in_the_way(std::span<const Gap> gaps, const Drive& aim) noexcept;
  RT_SAFE bool would_enter(const Drive& pose, std::span<const Gap> gaps) noexcept;

  const RobotHand& robot_;
  double margin_m_;
  Placed placed_;
  Gaps gaps_{}, there_{};
  std::array<StepRow, kMaxGaps> rows_{};
  StepProgram program_;
  Drive pose_, velocity_ = Drive::Zero();
  std::uint64_t limited_ = 0, hard_stops_ = 0, stops_ = 0;
  std::pair<int, int> in_the_way_{-1, -1};
  double blocked_s_ = 0.0;
  bool is_stopped_ = false;  // counted
  bool in_contact_ = false;
};

}  // namespace posed::robot
