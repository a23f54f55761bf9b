// Motion: a clip as poses at one constant rate, prepared for training. Cold.
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
Result<Motion> motion_of(const clip::Clip& clip);

// Whether the first frame does not belong to the motion. Some converters put the figure's rest pose
// in front (CMU's cgspeed BVH files), so the step to the second frame is larger than any person
// moves.
[[nodiscard]] bool begins_with_added_pose(const Motion& motion);
[[nodiscard]] bool begins_with_added_pose(const clip::Clip& clip);
// motion_of() without such a pose.
Result<Motion> performed_motion_of(const clip::Clip& clip);
void drop_first_frame(Motion& motion);

// The motion resampled. To a lower rate: a zero-phase low-pass at a third of the new
// rate (10 Hz at 30), then slerp. To a higher rate: slerp alone. An equal rate returns the motion
// unchanged.
[[nodiscard]] Motion resample(const Motion& motion, double rate_hz);

// Direction of the walk [rad about +Y, 0 is +Z]: the line from the first to the last root position,
// or the mean direction of the pelvis where that line is shorter than half a metre.
[[nodiscard]] double walk_heading_rad(const Motion& motion);

// Root positions [frames x 3], m, seen from `heading_rad`.
[[nodiscard]] Eigen::MatrixXd root_positions_m(const Motion& motion, double heading_rad);

// q of every frame [frames x dims], rad.
[[nodiscard]] Eigen::MatrixXd pose_vectors(const Motion& motion, const PoseSpace& space,
                                           double heading_rad);

// Sets the means of `spec` to the mean rotations over these motions, all with equal weight. cmu43
// has no means. Returns an error for a skeleton that lacks joints of the space.
Result<> set_mean_rotations(std::span<const Motion* const> motions, PoseSpaceSpec& spec);

// LegSignal of every frame [rad]. Empty when the skeleton names no upper legs.
[[nodiscard]] std::optional<Eigen::VectorXd> leg_signal(const Motion& motion);

// d/dt of each column: central differences, one-sided at the ends.
[[nodiscard]] Eigen::MatrixXd time_derivative(const Eigen::MatrixXd& values, double rate_hz);

// Zero-phase Butterworth low-pass of the fourth order: run forwards, then backwards over the signal
// extended by point reflection at both ends (scipy's butter(4) and filtfilt with its default
// padding, to rounding). Cold. Filters each column of `signal` [frames x channels]. `cutoff` is a
// fraction of half the sample rate, between 0 and 1. Fewer than two frames come back as they are.
[[nodiscard]] Eigen::MatrixXd low_pass_zero_phase(const Eigen::MatrixXd& signal, double cutoff);

}  // namespace posed::motion
