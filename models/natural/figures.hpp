// Figures: the numbers by which `posed eval natural` tells whether people move as in a clip
// (models/natural/README.md, "Figures"): how rough it is, which poses and changes it has, how far
// its joints turn, how its feet stand. Cold; thread-safe.
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

// Clips can be compared if they have one rate and the same channels in the same order.
struct Figures {
  double jerk = 0.0;   // rms third difference of the angles, deg/frame^3
  double sparc = 0.0;  // spectral arc length of their speed; NaN if nothing moves
  motion::WindowSums windows;
  Eigen::VectorXd low_deg, high_deg;          // [channel] its range; 0 for those of the root
  std::optional<double> slide_cm_s, sink_cm;  // empty: no feet that stand
  // Empty but for persons: the lengths of the limbs, by which persons are told apart (0: there is
  // none), and for each joint of the pose space 1 if the skeleton lacks it, else 0.
  Eigen::VectorXd limbs_m, lacks;
};

// Returns a person's skeleton with one bone for the trunk, because rigs divide the trunk in several
// ways: the last of spine, chest and upper chest becomes the chest, and the others lose their
// bones. Any other skeleton is returned as it is.
[[nodiscard]] std::shared_ptr<const Skeleton> with_one_trunk(
    std::shared_ptr<const Skeleton> skeleton);

// Returns the pose space in which clips of such skeletons are compared: for a person the bones that
// all rigs mean alike (hips, trunk, head, arms and legs) and that this one has; for any other
// figure its own joints.
Result<motion::PoseSpaceSpec> compared_space(const Skeleton& skeleton);
// Removes these joints from the space, but for its root.
void remove_joints(const std::vector<std::string>& joints, motion::PoseSpaceSpec& spec);

// Measures angles [frames x channels], deg, all but feet and limbs. Returns an error for fewer
// frames than the features need.
Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz);

// Measures a body by the rotation vectors of its joints about the mean rotations of `spec`.
// Returns an error for a skeleton that lacks joints of `spec`; a person may lack head, trunk, hands
// and feet (Figures::lacks), whose angles are then 0.
Result<Figures> figures_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec);

// Appends the figures to a task's numbers; figures_from() reads them back.
void write(const Figures& figures, NumberWriter& numbers);
[[nodiscard]] Figures figures_from(NumberReader& numbers);

}  // namespace posed::natural
