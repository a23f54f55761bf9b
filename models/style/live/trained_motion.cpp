#include "models/style/live/trained_motion.hpp"

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

TrainedMotion::TrainedMotion(const StyleModel& model, const Skeleton& skeleton)
    : joints_(static_cast<double>(model.space.joints.size())),
      swing_rad_(model.gate.swing_rad),
      cadence_rad_s_(model.gate.strides() ? 2.0 * std::numbers::pi / model.gate.fastest_stride_s
                                          : 0.0),
      gait_correlation_(model.gate.gait_correlation),
      root_joint_(skeleton.root_joint) {
  if (model.gate.strides()) legs_ = motion::LegSignal::find(skeleton);
  const Eigen::MatrixXf kept = kept_poses(model.process, kPoses).cast<float>();
  const Eigen::Index blocks = (kept.rows() + kBlock - 1) / kBlock;
  poses_.resize(kBlock, blocks * kept.cols());
  for (Eigen::Index i = 0; i < blocks * kBlock; ++i) {
    const Eigen::Index pose = std::min(i, kept.rows() - 1);  // the last one fills the last block
    for (Eigen::Index d = 0; d < kept.cols(); ++d) {
      poses_(i % kBlock, i / kBlock * kept.cols() + d) = kept(pose, d);
    }
  }
}

// Of the squares' sum over the available dimensions.
RT_SAFE double TrainedMotion::rms_deg(float sum_rad2,
                                      std::span<const std::uint8_t> available) const noexcept {
  double there = 0.0;
  for (const std::uint8_t one : available) there += one != 0 ? 1.0 : 0.0;
  if (there == 0.0) return std::numeric_limits<double>::quiet_NaN();
  const double whole_rad2 =
      static_cast<double>(sum_rad2) * static_cast<double>(available.size()) / there;
  return std::sqrt(whole_rad2 / joints_) / kDegree;
}

RT_SAFE double TrainedMotion::distance_deg(std::span<const float> q,
                                           std::span<const std::uint8_t> available) const noexcept {
  const auto dims = static_cast<Eigen::Index>(q.size());
  Block nearest = Block::Constant(std::numeric_limits<float>::infinity());
  for (Eigen::Index first = 0; first < poses_.cols(); first += dims) {
    Block sum = Block::Zero();
    for (Eigen::Index d = 0; d < dims; ++d) {
      if (available[d] == 0) continue;
      sum += (q[d] - poses_.col(first + d)).square();
    }
    nearest = nearest.min(sum);
  }
  return rms_deg(nearest.minCoeff(), available);
}

RT_SAFE TrainedMotion::PartDistances TrainedMotion::part_distances_deg(
    std::span<const float> q, std::span<const std::uint8_t> available,
    std::span<const LoosePart> parts) const noexcept {
  const auto dims = static_cast<Eigen::Index>(q.size());
  std::array<Block, kLooseParts + 1> nearest;
  nearest.fill(Block::Constant(std::numeric_limits<float>::infinity()));
  for (Eigen::Index first = 0; first < poses_.cols(); first += dims) {
    std::array<Block, kLooseParts + 1> sum;
    sum.fill(Block::Zero());
    for (Eigen::Index d = 0; d < dims; ++d) {
      if (available[d] == 0) continue;
      sum[index_of(parts[d])] += (q[d] - poses_.col(first + d)).square();
    }
    for (const LoosePart shoulder : kShoulders) {
      sum[index_of(whole_part(shoulder))] += sum[index_of(shoulder)];
    }
    for (std::size_t p = 0; p < kLooseParts; ++p) nearest[p] = nearest[p].min(sum[p]);
  }
  std::array<int, kLooseParts + 1> count{};
  for (Eigen::Index d = 0; d < dims; ++d) count[index_of(parts[d])] += available[d] != 0 ? 1 : 0;
  for (const LoosePart shoulder : kShoulders) {
    count[index_of(whole_part(shoulder))] += count[index_of(shoulder)];
  }
  PartDistances found{};
  for (std::size_t p = 0; p < kLooseParts; ++p) {
    if (count[p] == 0) continue;
    const float joints = static_cast<float>(count[p]) / 3.0F;
    found[p] = std::sqrt(nearest[p].minCoeff() / joints) / static_cast<float>(kDegree);
  }
  return found;
}

RT_SAFE double TrainedMotion::turn_deg(std::span<const float> from, std::span<const float> to,
                                       std::span<const std::uint8_t> available) const noexcept {
  float sum = 0.0F;
  for (std::size_t d = 0; d < from.size(); ++d) {
    if (available[d] != 0) sum += (to[d] - from[d]) * (to[d] - from[d]);
  }
  return rms_deg(sum, available);
}

RT_SAFE double TrainedMotion::height_m(const Frame& frame) const noexcept {
  return frame.valid[root_joint_] ? static_cast<double>(frame.root_position_m[1])
                                  : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace posed::style
