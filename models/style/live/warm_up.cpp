#include "models/style/live/warm_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>

#include "posed/v1/log.pb.h"

namespace posed::style {
namespace {

constexpr double kMinWalked = 0.5;  // of the time

constexpr double kStep_rad = 1e-4;
constexpr std::size_t kDims = motion::kMaxPoseDims;
constexpr double kMaxSpeed_rad_s = 1000.0;
constexpr double kMaxSwingStep_rad = 0.1;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kLoop_rad_s = 1.5;           // of the loop that makes the phase even
constexpr double kMinTurn_rad = 1.2 * kTurn;  // of a cycle
constexpr double kRidge = 1e-3;               // on its harmonics

// The mean and the harmonics of a cycle.
using Basis = Eigen::Matrix<double, kCycleRows, 1>;

Basis basis_at(double phase_rad) noexcept {
  Basis basis;
  basis[0] = 1.0;
  for (int n = 1; n <= kCycleHarmonics; ++n) {
    basis[n] = std::cos(n * phase_rad);
    basis[kCycleHarmonics + n] = std::sin(n * phase_rad);
  }
  return basis;
}

// A Walker in a small part of its size.
struct Packed {
  static constexpr std::size_t kSwings = 2 * kCycleHarmonics;
  static constexpr std::size_t kSwingDims = 96;  // a body's; fingers of large figures hang still

  std::array<std::int16_t, kDims> neutral{};                         // in steps
  std::array<std::array<std::int8_t, kSwings>, kSwingDims> swing{};  // harmonics, in swing steps
  float swing_step_rad = 0.0F;                                       // 0: there is no cycle
  std::array<std::uint8_t, (kDims + 7) / 8> measured{};
  float cadence_rad_s = std::numeric_limits<float>::quiet_NaN();

  [[nodiscard]] bool has(std::size_t d) const noexcept {
    return (measured[d / 8] >> (d % 8) & 1U) != 0;
  }
  void add(std::size_t d, std::int16_t steps) noexcept {
    neutral[d] = steps;
    measured[d / 8] = static_cast<std::uint8_t>(measured[d / 8] | 1U << (d % 8));
  }
};

void pack_cycle(const PoseCycle& cycle, Packed& packed) noexcept {
  const auto dims = std::min<std::size_t>(cycle.cols(), Packed::kSwingDims);
  Eigen::Matrix<double, kCycleRows, Packed::kSwingDims> harmonics;
  harmonics.setZero();
  for (int t = 0; t < kGridFrames; ++t) {
    const Basis basis = 2.0 / kGridFrames * basis_at(kTurn * t / kGridFrames);
    for (std::size_t d = 0; d < dims; ++d) {
      const double value = static_cast<double>(cycle(t, d));
      if (std::isfinite(value)) harmonics.col(d) += value * basis;
    }
  }
  const auto swings = harmonics.bottomRows<2 * kCycleHarmonics>();
  const double largest = swings.cwiseAbs().maxCoeff();
  if (largest <= 0.0) return;
  packed.swing_step_rad = static_cast<float>(largest / 127.0);
  for (std::size_t d = 0; d < dims; ++d) {
    for (std::size_t n = 0; n < Packed::kSwings; ++n) {
      packed.swing[d][n] = static_cast<std::int8_t>(std::lround(127.0 * swings(n, d) / largest));
    }
  }
}

RT_SAFE PoseCycle cycle_of(const Packed& packed, const Walker& walker) noexcept {
  PoseCycle cycle;
  if (packed.swing_step_rad == 0.0F) return cycle;
  cycle.setConstant(kGridFrames, kDims, std::numeric_limits<float>::quiet_NaN());
  for (int t = 0; t < kGridFrames; ++t) {
    const Eigen::Matrix<float, kCycleRows, 1> basis =
        basis_at(kTurn * t / kGridFrames).cast<float>() * packed.swing_step_rad;
    for (std::size_t d = 0; d < Packed::kSwingDims; ++d) {
      if (walker.measured[d] == 0) continue;
      float value = walker.neutral[d];
      for (std::size_t n = 0; n < Packed::kSwings; ++n) {
        value += static_cast<float>(packed.swing[d][n]) * basis[static_cast<Eigen::Index>(n + 1)];
      }
      cycle(t, static_cast<Eigen::Index>(d)) = value;
    }
  }
  return cycle;
}

}  // namespace

StageCommand command_of(const Walker& walker) noexcept {
  constexpr double kMaxValue = std::numeric_limits<std::int16_t>::max();
  Packed packed;
  for (std::size_t d = 0; d < kDims; ++d) {
    if (walker.measured[d] == 0) continue;
    const double steps = std::round(static_cast<double>(walker.neutral[d]) / kStep_rad);
    packed.add(d, static_cast<std::int16_t>(std::clamp(steps, -kMaxValue, kMaxValue)));
  }
  packed.cadence_rad_s = static_cast<float>(walker.cadence_rad_s);
  pack_cycle(walker.cycle, packed);
  return StageCommand::of(packed);
}

RT_SAFE Walker walker_of(const StageCommand& command) noexcept {
  const auto packed = command.as<Packed>();
  Walker walker;
  for (std::size_t d = 0; d < kDims; ++d) {
    if (!packed.has(d)) continue;
    walker.measured[d] = 1;
    walker.neutral[d] = static_cast<float>(packed.neutral[d] * kStep_rad);
  }
  walker.cycle = cycle_of(packed, walker);
  walker.cadence_rad_s = static_cast<double>(packed.cadence_rad_s);
  return walker;
}

void walker_to_log(const StageCommand& command, v1::DecisionValue& value) {
  const auto packed = command.as<Packed>();
  v1::DecisionValue::Walker& walker = *value.mutable_walker();
  for (std::size_t d = 0; d < kDims; ++d) {
    if (!packed.has(d)) continue;
    walker.add_dimension(static_cast<std::uint32_t>(d));
    walker.add_angle(packed.neutral[d]);
  }
  if (!std::isnan(packed.cadence_rad_s)) walker.set_cadence_rad_s(packed.cadence_rad_s);
  if (packed.swing_step_rad == 0.0F) return;
  walker.set_swing_step_rad(packed.swing_step_rad);
  for (const auto& swings : packed.swing) {
    for (const std::int8_t swing : swings) walker.add_swing(swing);
  }
}

std::optional<StageCommand> walker_from_log(const v1::DecisionValue& value) {
  if (!value.has_walker()) return std::nullopt;
  const v1::DecisionValue::Walker& walker = value.walker();
  if (walker.dimension_size() != walker.angle_size()) return std::nullopt;
  Packed packed;
  for (int i = 0; i < walker.dimension_size(); ++i) {
    const std::uint32_t d = walker.dimension(i);
    const auto steps = static_cast<std::int16_t>(walker.angle(i));
    if (d >= kDims || packed.has(d) || steps != walker.angle(i)) return std::nullopt;
    packed.add(d, steps);
  }
  if (walker.has_cadence_rad_s()) {
    if (!(std::abs(walker.cadence_rad_s()) <= kMaxSpeed_rad_s)) return std::nullopt;
    packed.cadence_rad_s = walker.cadence_rad_s();
  }
  if (walker.swing_size() == 0) return StageCommand::of(packed);
  const double step_rad = walker.swing_step_rad();
  if (walker.swing_size() != Packed::kSwingDims * Packed::kSwings) return std::nullopt;
  if (!(step_rad > 0.0 && step_rad <= kMaxSwingStep_rad)) return std::nullopt;
  packed.swing_step_rad = walker.swing_step_rad();
  for (int i = 0; i < walker.swing_size(); ++i) {
    const auto swing = static_cast<std::int8_t>(walker.swing(i));
    if (swing != walker.swing(i)) return std::nullopt;
    packed.swing[i / Packed::kSwings][i % Packed::kSwings] = swing;
  }
  return StageCommand::of(packed);
}

RT_SAFE bool Walker::convert(const motion::PoseSpace& from, const motion::PoseSpace& to) noexcept {
  std::array<float, motion::kMaxPoseDims> moved{};
  if (!to.convert(from, neutral, moved)) return false;
  neutral = moved;
  for (Eigen::Index t = 0; t < cycle.rows(); ++t) {
    std::array<float, motion::kMaxPoseDims> pose{};
    for (Eigen::Index d = 0; d < cycle.cols(); ++d) pose[static_cast<std::size_t>(d)] = cycle(t, d);
    static_cast<void>(to.convert(from, pose, moved));
    for (Eigen::Index d = 0; d < cycle.cols(); ++d) {
      cycle(t, d) = moved[static_cast<std::size_t>(d)];
    }
  }
  return true;
}

RT_SAFE void WarmUp::begin(double seconds) noexcept {
  *this = {};
  seconds_ = left_s_ = seconds;
}

RT_SAFE WarmUp::Outcome WarmUp::update(std::span<const float> q,
                                       std::span<const std::uint8_t> available,
                                       const LegMotion& legs, double dt_s) noexcept {
  if (!running()) return Outcome::kNone;
  left_s_ -= dt_s;
  dims_ = q.size();
  follow(legs, dt_s);
  if (legs.walk) {
    walked_s_ += dt_s;
    add_to_cycle(q, available, legs.leg_rad, dt_s);
    for (std::size_t d = 0; d < q.size(); ++d) {
      if (available[d] == 0) continue;
      sum_[d] += dt_s * static_cast<double>(q[d]);
      time_s_[d] += dt_s;
    }
    if (!std::isnan(legs.cadence_rad_s)) {
      turned_rad_ += dt_s * std::abs(legs.cadence_rad_s);
      turned_s_ += dt_s;
    }
  }
  if (running()) return Outcome::kNone;
  return walked_s_ >= kMinWalked * seconds_ ? Outcome::kDone : Outcome::kStood;
}

// A loop that is slower than a stride makes the angle's uneven rounds even.
RT_SAFE void WarmUp::follow(const LegMotion& legs, double dt_s) noexcept {
  if (std::isnan(legs.cadence_rad_s) || std::isnan(legs.leg_rad)) {
    rate_rad_s_ = 0.0;
  } else if (rate_rad_s_ == 0.0) {
    phase_rad_ = legs.angle_rad;
    rate_rad_s_ = legs.cadence_rad_s;
  } else {
    phase_rad_ += dt_s * rate_rad_s_;
    const double behind = std::remainder(legs.angle_rad - phase_rad_, kTurn);
    phase_rad_ += dt_s * 2.0 * kLoop_rad_s * behind;
    rate_rad_s_ += dt_s * kLoop_rad_s * kLoop_rad_s * behind;
  }
}

RT_SAFE void WarmUp::add_to_cycle(std::span<const float> q, std::span<const std::uint8_t> available,
                                  double leg_rad, double dt_s) noexcept {
  if (rate_rad_s_ == 0.0) return;
  const Basis basis = basis_at(phase_rad_);
  cycle_s_ += dt_s;
  cycle_rad_ += dt_s * std::abs(rate_rad_s_);
  gram_ += dt_s * basis * basis.transpose();
  leg_moment_ += dt_s * leg_rad * basis;
  for (std::size_t d = 0; d < q.size(); ++d) {
    if (available[d] == 0) continue;
    cycle_time_s_[d] += dt_s;
    Eigen::Map<Basis>(moment_[d].data()) += dt_s * static_cast<double>(q[d]) * basis;
  }
}

// Without columns where less than a stride was seen; NaN where a dimension was not always measured.
RT_SAFE PoseCycle WarmUp::cycle() const noexcept {
  PoseCycle found;
  if (cycle_rad_ < kMinTurn_rad) return found;
  auto ridged = gram_;
  ridged.diagonal().tail<kCycleRows - 1>().array() += kRidge * cycle_s_;
  const Eigen::LLT<Eigen::Matrix<double, kCycleRows, kCycleRows>> factor(ridged);
  const Basis leg = factor.solve(leg_moment_);
  const double late_rad = std::atan2(leg[1 + kCycleHarmonics], leg[1]);
  found = PoseCycle::Zero(kGridFrames, static_cast<Eigen::Index>(dims_));
  std::array<Basis, kGridFrames> at;
  for (int t = 0; t < kGridFrames; ++t) at[t] = basis_at(kTurn * t / kGridFrames + late_rad);
  for (std::size_t d = 0; d < dims_; ++d) {
    const bool always = cycle_time_s_[d] >= (1.0 - 1e-9) * cycle_s_;
    const Basis c = factor.solve(Eigen::Map<const Basis>(moment_[d].data()));
    for (int t = 0; t < kGridFrames; ++t) {
      found(t, static_cast<Eigen::Index>(d)) =
          always ? static_cast<float>(at[t].dot(c)) : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return found;
}

RT_SAFE Walker WarmUp::walker() const noexcept {
  Walker walker;
  for (std::size_t d = 0; d < sum_.size(); ++d) {
    if (time_s_[d] <= 0.0) continue;
    walker.measured[d] = 1;
    walker.neutral[d] = static_cast<float>(sum_[d] / time_s_[d]);
  }
  if (turned_s_ > 0.0) walker.cadence_rad_s = turned_rad_ / turned_s_;
  walker.cycle = cycle();
  return walker;
}

}  // namespace posed::style
