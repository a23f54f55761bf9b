// WarmUp: measures a walker's own neutral pose and cadence from a few seconds of walking
// (README.md, "Warm-up"). RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "models/motion/pose_space.hpp"

namespace posed::style {

// What a warm-up has found, in the pose space of a model.
struct Walker {
  std::array<float, motion::kMaxPoseDims> neutral{};          // mean of q [dims]
  std::array<std::uint8_t, motion::kMaxPoseDims> measured{};  // 0: this joint was never measured
  double cadence_rad_s = std::numeric_limits<double>::quiet_NaN();  // NaN: not known
};

class WarmUp {
 public:
  enum class Outcome : std::uint8_t { kNone, kDone, kStood };

  // Starts anew, for so many seconds of the stream.
  void begin(double seconds) noexcept;
  void stop() noexcept { left_s_ = 0.0; }
  [[nodiscard]] bool running() const noexcept { return left_s_ > 0.0; }

  // A frame `dt_s` after the last one; only those on which the walker walks count. Not kNone at the
  // frame that ends it: kStood where the walker walked for less than half of the time.
  [[nodiscard]] Outcome update(std::span<const float> q, std::span<const std::uint8_t> available,
                               bool walks, double cadence_rad_s, double dt_s) noexcept;
  // After kDone.
  [[nodiscard]] Walker walker() const noexcept;

 private:
  using Sums = std::array<double, motion::kMaxPoseDims>;

  double seconds_ = 0.0, left_s_ = 0.0, walked_s_ = 0.0;
  double turned_rad_ = 0.0, turned_s_ = 0.0;
  Sums sum_{}, time_s_{};
};

}  // namespace posed::style
