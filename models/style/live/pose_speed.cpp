#include "models/style/live/pose_speed.hpp"

#include <cmath>

namespace posed::style {
namespace {

constexpr double kSpeedMemory_s = 0.04;  // time constant of the low-pass

}  // namespace

// RT-safe
void PoseSpeed::update(const KnownMotion& known, std::span<const float> q,
                       std::span<const std::uint8_t> available, double dt_s) noexcept {
  const std::span<float> last(last_.data(), q.size());
  if (dims_ == q.size() && dt_s > 0.0) {
    const double speed_deg_s = known.turn_deg(last, q, available) / dt_s;
    if (std::isnan(speed_deg_s_)) {
      speed_deg_s_ = speed_deg_s;
    } else if (!std::isnan(speed_deg_s)) {
      speed_deg_s_ -= std::expm1(-dt_s / kSpeedMemory_s) * (speed_deg_s - speed_deg_s_);
    }
  }
  dims_ = q.size();
  for (std::size_t d = 0; d < q.size(); ++d) {
    if (available[d] != 0) last[d] = q[d];
  }
}

}  // namespace posed::style
