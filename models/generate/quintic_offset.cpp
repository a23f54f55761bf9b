#include "models/generate/quintic_offset.hpp"

namespace posed::generate {

// RT-safe.
void QuinticOffset::start(const HandAngles& offset, const HandAngles& velocity,
                          int frames) noexcept {
  offset_ = offset;
  velocity_ = velocity;
  frame_ = 0;
  frames_ = frames;
}

// RT-safe.
HandAngles QuinticOffset::next() noexcept {
  HandAngles offset{};
  if (done()) return offset;
  ++frame_;
  const double t = static_cast<double>(frame_) / frames_;
  const double t3 = t * t * t;
  const double of_position = 1.0 - t3 * (10.0 - t * (15.0 - 6.0 * t));
  const double of_velocity = frames_ * (t - t3 * (6.0 - t * (8.0 - 3.0 * t)));
  for (std::size_t c = 0; c < offset.size(); ++c) {
    offset[c] = of_position * offset_[c] + of_velocity * velocity_[c];
  }
  return offset;
}

}  // namespace posed::generate
