// What a walk looks like from outside, as a mean cycle: height and speed of the hips and the
// directions of bones. Unlike angles of joints these tell bounce, pace and how the limbs point,
// also between figures of other sizes and joints, and so what of a difference that was taught
// arrives on a walker who was not. Cold.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "models/motion/motion.hpp"
#include "models/style/model/stride_phase.hpp"
#include "proto/frame/humanoid.hpp"

namespace posed::style {

// Empty for a clip without legs, and for one without a whole stride.
[[nodiscard]] std::optional<WalkPhases> walk_phases(const motion::Motion& motion);

struct BodyCycle {
  Eigen::VectorXd height;   // of the hips above the ground [28], in lengths of a leg
  Eigen::VectorXd speed_s;  // of the hips, forward [28], in lengths of a leg a second
  double cadence_rad_s = 0.0;
  // From a joint to another, of those that the figure has: arms, legs, trunk, hips and shoulders
  // from right to left.
  std::vector<std::pair<Bone, Bone>> bones;
  Eigen::MatrixXd direction;  // of those [28 x 3 a bone], unit length, seen from the walk
  double lean_rad = 0.0;      // of the head before the hips, in the mean
};
// Empty where the figure lacks legs or hips.
[[nodiscard]] std::optional<BodyCycle> body_cycle(const motion::Motion& motion,
                                                  const WalkPhases& walk);

// How far two cycles are apart, rms over the cycle; directions over the bones of both, the tempo as
// the share by which one cadence is beyond the other.
struct BodyError {
  double height = 0.0, speed_s = 0.0, direction_rad = 0.0, tempo = 0.0;
};
[[nodiscard]] BodyError apart(const BodyCycle& a, const BodyCycle& b);

// How far a source and its styled copy are from the target; the floor is how far the halves of the
// target are from each other, empty where they hold no stride.
struct BodyErrors {
  BodyError source, styled;
  std::optional<BodyError> floor;
  double leg_m = 0.0;  // of the source's figure
};
// Empty where a clip shows no walk with legs.
[[nodiscard]] std::optional<BodyErrors> body_errors(const motion::Motion& source,
                                                    const motion::Motion& styled,
                                                    const motion::Motion& target);

// What a walker gets of the difference that two clips teach, in the directions of the bones that
// all have.
struct Arrival {
  double missing = 0.0;        // |change - taught| / |taught|: 0 all arrives, 1 nothing does
  double arms_rad = 0.0;       // what the change of the four directions of the arms is off by, rms
  double worst_arm_rad = 0.0;  // of the one of them that is off most
  double lean_rad = 0.0;       // how far the trunk leans beyond the taught change
  double unstyled_arms_rad = 0.0, unstyled_lean_rad = 0.0;  // the same where nothing changes
  // What the halves of the clips teach differs by; empty where they hold no stride.
  std::optional<double> floor;
};
// Empty where a clip shows no walk with legs. `before` and `after` are the walker's, who walks on
// the same legs in both; `source` and `target` teach.
[[nodiscard]] std::optional<Arrival> arrival(const motion::Motion& before,
                                             const motion::Motion& after,
                                             const motion::Motion& source,
                                             const motion::Motion& target);

}  // namespace posed::style
