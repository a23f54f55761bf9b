// WarmUp: measures a walker's own neutral pose and cadence from a few seconds of walking
// (models/style/README.md, "Warm-up"). RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "models/motion/pose_space.hpp"
#include "models/stage.hpp"
#include "models/style/live/leg_map.hpp"

namespace posed::v1 {
class DecisionValue;
}  // namespace posed::v1

namespace posed::style {

// How somebody walks, as a warm-up measures it, in the pose space of a model.
struct Walker {
  std::array<float, motion::kMaxPoseDims> neutral{};          // mean of q [dims]
  std::array<std::uint8_t, motion::kMaxPoseDims> measured{};  // 0: this joint was never measured
  double cadence_rad_s = std::numeric_limits<double>::quiet_NaN();  // NaN: not known
  // The mean cycle [kGridFrames x dims], NaN where it is not known; without columns there is none.
  PoseCycle cycle{};

  // From one space to another of the same joints; false, and nothing changes, for other joints.
  [[nodiscard]] bool convert(const motion::PoseSpace& from, const motion::PoseSpace& to) noexcept;
};

// The legs at a frame, as the gate sees them.
struct LegMotion {
  bool walk = false;
  double cadence_rad_s = std::numeric_limits<double>::quiet_NaN();
  double angle_rad = 0.0;                                     // LiveStride::angle_rad
  double leg_rad = std::numeric_limits<double>::quiet_NaN();  // the leg signal
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
                               const LegMotion& legs, double dt_s) noexcept;
  // After kDone.
  [[nodiscard]] Walker walker() const noexcept;

 private:
  using Sums = std::array<double, motion::kMaxPoseDims>;
  using Basis = Eigen::Matrix<double, kCycleRows, 1>;

  void follow(const LegMotion& legs, double dt_s) noexcept;
  void add_to_cycle(std::span<const float> q, std::span<const std::uint8_t> available,
                    double leg_rad, double dt_s) noexcept;
  [[nodiscard]] PoseCycle cycle() const noexcept;

  double seconds_ = 0.0, left_s_ = 0.0, walked_s_ = 0.0;
  double turned_rad_ = 0.0, turned_s_ = 0.0;
  Sums sum_{}, time_s_{};

  // The cycle, by least squares of harmonics at an even phase that follows the legs' angle.
  std::size_t dims_ = 0;
  double phase_rad_ = 0.0, rate_rad_s_ = 0.0;  // no rate: not begun
  double cycle_s_ = 0.0, cycle_rad_ = 0.0;     // seen so far
  Eigen::Matrix<double, kCycleRows, kCycleRows> gram_ =
      Eigen::Matrix<double, kCycleRows, kCycleRows>::Zero();
  Basis leg_moment_ = Basis::Zero();
  std::array<std::array<double, kCycleRows>, motion::kMaxPoseDims> moment_{};
  Sums cycle_time_s_{};
};

// A walker as a command of the style stage, and as the device log keeps that command: so a walker
// that is known from a clip (parameter `neutral`) replays like one that was warmed up live.
// Rounds angles to 1e-4 rad, because a command is small. Angles are those of q, within +-pi. Cold.
[[nodiscard]] StageCommand command_of(const Walker& walker) noexcept;
RT_SAFE [[nodiscard]] Walker walker_of(const StageCommand& command) noexcept;

void walker_to_log(const StageCommand& command, v1::DecisionValue& value);
// Empty for a value that walker_to_log() cannot have written.
[[nodiscard]] std::optional<StageCommand> walker_from_log(const v1::DecisionValue& value);

}  // namespace posed::style
