// The figures of one clip by which `eval natural` tells whether people move like that (README.md):
// how rough it is, which poses and changes it has, how far its joints turn, how its feet stand.
// Cold; thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "models/motion/motion.hpp"
#include "models/motion/naturalness.hpp"
#include "models/task_numbers.hpp"
#include "proto/frame/result.hpp"

namespace posed::natural {

// The figures of a clip. Clips to compare have one rate and equal channels in equal order.
struct Figures {
  double jerk = 0.0;   // rms third difference of the angles, deg/frame^3
  double sparc = 0.0;  // spectral arc length of their speed; NaN if nothing moves
  motion::WindowSums windows;
  Eigen::VectorXd low_deg, high_deg;          // range of each channel
  std::optional<double> slide_cm_s, sink_cm;  // of bodies whose feet stand
  // Of persons: the lengths of arms and legs, by which they are told apart (0: lacks it), and 1 for
  // each joint of the space that this one lacks. Empty: of other figures.
  Eigen::VectorXd limbs_m, lacks;
};

// A person's skeleton with one bone for the trunk, because rigs divide it as they like: the last of
// spine, chest and upper chest is the chest, the others are no bones. Others are as they were.
[[nodiscard]] std::shared_ptr<const Skeleton> with_one_trunk(
    std::shared_ptr<const Skeleton> skeleton);

// The space in which clips of such skeletons are compared: for persons the bones that all rigs mean
// alike (hips, trunk, head, arms and legs) and that this one has; for others their own joints.
Result<motion::PoseSpaceSpec> compared_space(const Skeleton& skeleton);
// The same without these joints.
void remove_joints(const std::vector<std::string>& joints, motion::PoseSpaceSpec& spec);

// Measures angles [frames x channels], deg. Returns an error where they are too short for features.
Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz);

// Measures a body at one rate by the rotation vectors of its joints about the means of `spec`.
// Returns an error for a skeleton that lacks joints of `spec`; a person may lack head, trunk, hands
// and feet (Figures::lacks), whose angles are then 0.
Result<Figures> figures_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec);

// Packs the figures as a task's numbers, behind those that `numbers` has, and reads them back.
void write(const Figures& figures, NumberWriter& numbers);
[[nodiscard]] Figures figures_from(NumberReader& numbers);

}  // namespace posed::natural
