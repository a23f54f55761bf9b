// Motion: a clip as poses at one constant rate, ready for learning. Cold.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "models/motion/pose_space.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::motion {

struct Motion {
  std::shared_ptr<const Skeleton> skeleton;
  double rate_hz = 0.0;
  std::vector<Frame> frames;

  [[nodiscard]] int size() const { return static_cast<int>(frames.size()); }
};

// The clip's poses at the clip's own rate. Refuses a clip without frames, without a rate, or with a
// value that is not finite; the error names the clip and the frame.
[[nodiscard]] Result<Motion> motion_of(const clip::Clip& clip);

// Whether the first frame is no part of the motion: some converters put the figure's rest pose in
// front (CMU's cgspeed BVH files), a jump to the second frame that nobody makes.
[[nodiscard]] bool begins_with_added_pose(const Motion& motion);
void drop_first_frame(Motion& motion);

// The same motion at another rate. Downwards: zero-phase low-pass at a third of the new rate (10 Hz
// at 30), then slerp, as upwards. The same rate is returned as it is.
[[nodiscard]] Motion resample(const Motion& motion, double rate_hz);

// Which way the walk goes [rad about +Y, 0 is +Z]: the chord from the first to the last root
// position, or the mean direction of the pelvis where the chord is shorter than half a metre.
[[nodiscard]] double walk_heading_rad(const Motion& motion);

// Root positions [frames x 3], m, seen from `heading_rad`.
[[nodiscard]] Eigen::MatrixXd root_positions_m(const Motion& motion, double heading_rad);

// q of every frame [frames x dims], rad.
[[nodiscard]] Eigen::MatrixXd pose_vectors(const Motion& motion, const PoseSpace& space,
                                           double heading_rad);

// Sets the means of `spec` to the mean rotations over these motions, each counting alike. cmu43 has
// none. Refuses a skeleton that cannot serve the space.
[[nodiscard]] Result<> set_mean_rotations(std::span<const Motion* const> motions,
                                          PoseSpaceSpec& spec);

// Right minus left flexion of the thigh [rad], forward positive, a value a frame. Nothing when the
// skeleton names no upper legs.
[[nodiscard]] std::optional<Eigen::VectorXd> leg_signal(const Motion& motion);

// d/dt of each column: central differences, one-sided at the ends.
[[nodiscard]] Eigen::MatrixXd time_derivative(const Eigen::MatrixXd& values, double rate_hz);

}  // namespace posed::motion
