#include "models/style/live/trained_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/gp/inducing.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using gp::kernel::kTile;

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
  const Eigen::Index tiles = (kept.rows() + kTile - 1) / kTile;
  for (Eigen::Index first = 0; first < tiles * kTile; first += kTile) {
    for (Eigen::Index d = 0; d < kept.cols(); ++d) {
      Row& row = rows_.emplace_back();
      for (Eigen::Index i = 0; i < kTile; ++i) {  // the last pose fills the last tile
        row.pose[i] = kept(std::min(first + i, kept.rows() - 1), d);
      }
    }
  }
}

// Of the squares' sum over the dimensions that are there.
RT_SAFE double TrainedMotion::rms_deg(float sum_rad2, int there, std::size_t dims) const noexcept {
  if (there == 0) return std::numeric_limits<double>::quiet_NaN();
  const double whole_rad2 = static_cast<double>(sum_rad2) * static_cast<double>(dims) / there;
  return std::sqrt(whole_rad2 / joints_) / kDegree;
}

RT_SAFE double TrainedMotion::distance_deg(std::span<const float> q,
                                           std::span<const std::uint8_t> available) const noexcept {
  static constexpr std::array<LoosePart, motion::kMaxPoseDims> kNoParts = [] {
    std::array<LoosePart, motion::kMaxPoseDims> none{};
    none.fill(LoosePart::kNone);
    return none;
  }();
  return distances_deg(q, available, std::span(kNoParts).first(q.size())).whole_deg;
}

RT_SAFE TrainedMotion::Distances TrainedMotion::distances_deg(
    std::span<const float> q, std::span<const std::uint8_t> available,
    std::span<const LoosePart> parts) const noexcept {
  std::array<std::uint16_t, motion::kMaxPoseDims> present;
  std::array<std::uint8_t, motion::kMaxPoseDims> part;
  std::array<int, kLooseParts + 1> of_part{};
  int there = 0;
  for (std::size_t d = 0; d < q.size(); ++d) {
    if (available[d] == 0) continue;
    present[there] = static_cast<std::uint16_t>(d);
    part[there] = static_cast<std::uint8_t>(parts[d]);
    ++of_part[index_of(parts[d])];
    ++there;
  }
  using Table = Eigen::Array<float, kTile, kLooseParts + 2>;  // of each part, the legs and all
  constexpr auto kWhole = static_cast<Eigen::Index>(kLooseParts) + 1;
  const gp::kernel::Parts query{q.data(), present.data(), part.data(), there};
  alignas(64) Table sums;
  alignas(64) Table nearest = Table::Constant(std::numeric_limits<float>::infinity());
  for (std::size_t tile = 0; tile < rows_.size(); tile += q.size()) {
    sums.setZero();
    gp::kernel::squares_of_parts(rows_[tile].pose.data(), query, sums.data(),
                                 sums.col(kWhole).data());
    for (const LoosePart shoulder : kShoulders) {
      sums.col(index_of(whole_part(shoulder))) += sums.col(index_of(shoulder));
    }
    nearest = nearest.min(sums);
  }
  for (const LoosePart shoulder : kShoulders) {
    of_part[index_of(whole_part(shoulder))] += of_part[index_of(shoulder)];
  }
  Distances found{.whole_deg = rms_deg(nearest.col(kWhole).minCoeff(), there, q.size()),
                  .part_deg = {}};
  for (std::size_t p = 0; p < kLooseParts; ++p) {
    if (of_part[p] == 0) continue;
    const float joints = static_cast<float>(of_part[p]) / 3.0F;
    found.part_deg[p] = std::sqrt(nearest.col(p).minCoeff() / joints) / static_cast<float>(kDegree);
  }
  return found;
}

RT_SAFE double TrainedMotion::turn_deg(std::span<const float> from, std::span<const float> to,
                                       std::span<const std::uint8_t> available) const noexcept {
  float sum = 0.0F;
  int there = 0;
  for (std::size_t d = 0; d < from.size(); ++d) {
    if (available[d] == 0) continue;
    sum += (to[d] - from[d]) * (to[d] - from[d]);
    ++there;
  }
  return rms_deg(sum, there, from.size());
}

RT_SAFE double TrainedMotion::height_m(const Frame& frame) const noexcept {
  return frame.valid[root_joint_] ? static_cast<double>(frame.root_position_m[1])
                                  : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace posed::style
