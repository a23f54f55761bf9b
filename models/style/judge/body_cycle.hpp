// What a walk looks like from outside, as a mean cycle: height and speed of the hips and the
// directions of bones. Unlike angles of joints these tell bounce, pace and how the limbs point,
// also between figures of other sizes and joints. Cold.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "models/motion/motion.hpp"
#include "models/style/model/stride_phase.hpp"
#include "proto/frame/humanoid.hpp"

namespace posed::style {

// Empty for a clip without legs, and for one without a whole stride.
[[nodiscard]] std::optional<WalkPhases> walk_phases(const motion::Motion& motion);

struct BodyCycle {
  Eigen::VectorXd height;     // of the hips above the ground [28], in lengths of a leg
  Eigen::VectorXd speed_s;    // of the hips, forward [28], in lengths of a leg a second
  std::vector<Bone> bones;    // that the figure has: arms, legs, trunk
  Eigen::MatrixXd direction;  // of those [28 x 3 a bone], unit length, seen from the walk
};
// Empty where the figure lacks legs or hips.
[[nodiscard]] std::optional<BodyCycle> body_cycle(const motion::Motion& motion,
                                                  const WalkPhases& walk);

// How far two cycles are apart, rms over the cycle; directions over the bones of both.
struct BodyError {
  double height = 0.0, speed_s = 0.0, direction_rad = 0.0;
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

}  // namespace posed::style
