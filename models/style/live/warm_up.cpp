#include "models/style/live/warm_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "posed/v1/log.pb.h"

namespace posed::style {
namespace {

constexpr double kMinWalked = 0.5;  // of the time

constexpr double kStep_rad = 1e-4;
constexpr std::size_t kDims = motion::kMaxPoseDims;
constexpr double kMaxSpeed_rad_s = 1000.0;

// A Walker in less than half of its size.
struct Packed {
  std::array<std::int16_t, kDims> neutral{};  // in steps
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

}  // namespace

StageCommand command_of(const Walker& walker) noexcept {
  constexpr double kMost = std::numeric_limits<std::int16_t>::max();
  Packed packed;
  for (std::size_t d = 0; d < kDims; ++d) {
    if (walker.measured[d] == 0) continue;
    const double steps = std::round(static_cast<double>(walker.neutral[d]) / kStep_rad);
    packed.add(d, static_cast<std::int16_t>(std::clamp(steps, -kMost, kMost)));
  }
  packed.cadence_rad_s = static_cast<float>(walker.cadence_rad_s);
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
  return StageCommand::of(packed);
}

RT_SAFE void WarmUp::begin(double seconds) noexcept {
  *this = {};
  seconds_ = left_s_ = seconds;
}

RT_SAFE WarmUp::Outcome WarmUp::update(std::span<const float> q,
                                       std::span<const std::uint8_t> available, bool walks,
                                       double cadence_rad_s, double dt_s) noexcept {
  if (!running()) return Outcome::kNone;
  left_s_ -= dt_s;
  if (walks) {
    walked_s_ += dt_s;
    for (std::size_t d = 0; d < q.size(); ++d) {
      if (available[d] == 0) continue;
      sum_[d] += dt_s * static_cast<double>(q[d]);
      time_s_[d] += dt_s;
    }
    if (!std::isnan(cadence_rad_s)) {
      turned_rad_ += dt_s * std::abs(cadence_rad_s);
      turned_s_ += dt_s;
    }
  }
  if (running()) return Outcome::kNone;
  return walked_s_ >= kMinWalked * seconds_ ? Outcome::kDone : Outcome::kStood;
}

RT_SAFE Walker WarmUp::walker() const noexcept {
  Walker walker;
  for (std::size_t d = 0; d < sum_.size(); ++d) {
    if (time_s_[d] <= 0.0) continue;
    walker.measured[d] = 1;
    walker.neutral[d] = static_cast<float>(sum_[d] / time_s_[d]);
  }
  if (turned_s_ > 0.0) walker.cadence_rad_s = turned_rad_ / turned_s_;
  return walker;
}

}  // namespace posed::style
