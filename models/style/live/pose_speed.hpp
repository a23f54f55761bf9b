// PoseSpeed: how fast a pose changes at this moment. Something of a walker always moves, also where
// the legs turn back; so a pose that rests is known as such before the legs tell (README.md,
// "Gate"). RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "models/motion/pose_space.hpp"
#include "models/style/live/trained_motion.hpp"

namespace posed::style {

class PoseSpeed {
 public:
  // The pose `dt_s` after the last one. `known` says what a distance between poses is.
  void update(const KnownMotion& known, std::span<const float> q,
              std::span<const std::uint8_t> available, double dt_s) noexcept;

  // Rms over joints, of the last 40 ms or so [deg/s]; NaN until two poses are known.
  [[nodiscard]] double value_deg_s() const noexcept { return speed_deg_s_; }

 private:
  std::array<float, motion::kMaxPoseDims> last_{};  // where a dimension was last there
  std::size_t dims_ = 0;                            // of the last pose; 0: there was none
  double speed_deg_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace posed::style
