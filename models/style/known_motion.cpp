#include "models/style/known_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/gp/inducing.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

Eigen::MatrixXd kept_poses(const gp::Trained& process, int limit) {
  if (process.inputs.rows() <= limit) return process.inputs;
  const auto kept = gp::choose_inducing(process.inputs, process.mu, limit,
                                        [](double /*worst*/) { return false; });
  return process.inputs(kept.chosen(), Eigen::all);
}

}  // namespace

KnownMotion::KnownMotion(const StyleModel& model, const Skeleton& skeleton)
    : poses_(kept_poses(model.process, kPoses).cast<float>()),
      joints_(static_cast<double>(model.space.joints.size())),
      swing_rad_(model.gate.swing_rad),
      cadence_rad_s_(model.gate.strides() ? 2.0 * std::numbers::pi / model.gate.fastest_stride_s
                                          : 0.0),
      gait_correlation_(model.gate.gait_correlation),
      root_joint_(static_cast<std::size_t>(skeleton.root_joint)) {
  if (model.gate.strides()) legs_ = motion::LegSignal::find(skeleton);
}

// Of the squares' sum over the available dimensions. RT-safe
double KnownMotion::rms_deg(float sum_rad2,
                            std::span<const std::uint8_t> available) const noexcept {
  double there = 0.0;
  for (const std::uint8_t one : available) there += one != 0 ? 1.0 : 0.0;
  if (there == 0.0) return std::numeric_limits<double>::quiet_NaN();
  const double whole_rad2 =
      static_cast<double>(sum_rad2) * static_cast<double>(available.size()) / there;
  return std::sqrt(whole_rad2 / joints_) / kDegree;
}

// RT-safe
double KnownMotion::distance_deg(std::span<const float> q,
                                 std::span<const std::uint8_t> available) const noexcept {
  const auto dims = static_cast<Eigen::Index>(q.size());
  float nearest = std::numeric_limits<float>::infinity();
  for (Eigen::Index i = 0; i < poses_.rows(); ++i) {
    const float* pose = poses_.data() + i * dims;
    float sum = 0.0F;
    for (Eigen::Index d = 0; d < dims && sum < nearest; ++d) {
      if (available[static_cast<std::size_t>(d)] == 0) continue;
      const float away = q[static_cast<std::size_t>(d)] - pose[d];
      sum += away * away;
    }
    nearest = std::min(nearest, sum);
  }
  return rms_deg(nearest, available);
}

// RT-safe
double KnownMotion::turn_deg(std::span<const float> from, std::span<const float> to,
                             std::span<const std::uint8_t> available) const noexcept {
  float sum = 0.0F;
  for (std::size_t d = 0; d < from.size(); ++d) {
    if (available[d] != 0) sum += (to[d] - from[d]) * (to[d] - from[d]);
  }
  return rms_deg(sum, available);
}

// RT-safe
double KnownMotion::height_m(const Frame& frame) const noexcept {
  return frame.valid[root_joint_] ? static_cast<double>(frame.root_position_m[1])
                                  : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace posed::style
