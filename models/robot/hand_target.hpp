// HandTarget: where a person's hand wants the robot's finger tips (models/robot/README.md,
// "Targets"). RT-safe.
#pragma once

#include "models/hand/geometry.hpp"
#include "models/robot/robot_hand.hpp"

namespace posed::robot {

inline constexpr int kMaxRobotFingers = 5;

struct HandTarget {
  std::array<Eigen::Vector3d, kMaxRobotFingers> tip_m;  // [finger], in the root's frame
  std::array<double, kMaxRobotFingers> tip_weight{};
  // Of the thumb and finger f: how near they are, 1 to 0, their gap [m] and its direction.
  std::array<double, kMaxRobotFingers> pinch{};
  std::array<double, kMaxRobotFingers> gap_m{};
  std::array<Eigen::Vector3d, kMaxRobotFingers> direction;  // from the finger to the thumb
};

class HandTargets {
 public:
  // `robot` must outlive it.
  HandTargets(const RobotHand& robot, const hand::HandGeometry& person);

  // `angles` are finite.
  RT_SAFE void find(const HandAngles& angles, HandTarget& target) noexcept;

 private:
  [[nodiscard]] Eigen::Vector3d to_robot(const Eigen::Vector3d& person) const noexcept;

  const RobotHand& robot_;
  hand::HandGeometry person_;
  hand::HandPose pose_;
  std::array<double, kMaxRobotFingers> scale_{};
};

}  // namespace posed::robot
