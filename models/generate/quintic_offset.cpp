#include "models/generate/quintic_offset.hpp"

#include <algorithm>

namespace posed::generate {

// RT-safe.
void QuinticOffset::start(std::span<const double> offset, std::span<const double> velocity,
                          int frames) noexcept {
  std::ranges::copy(offset, offset_.begin());
  std::ranges::copy(velocity, velocity_.begin());
  frame_ = 0;
  frames_ = frames;
}

// RT-safe.
void QuinticOffset::add_next(std::span<double> pose) noexcept {
  if (done()) return;
  ++frame_;
  const double t = static_cast<double>(frame_) / frames_;
  const double t3 = t * t * t;
  const double of_position = 1.0 - t3 * (10.0 - t * (15.0 - 6.0 * t));
  const double of_velocity = frames_ * (t - t3 * (6.0 - t * (8.0 - 3.0 * t)));
  for (std::size_t c = 0; c < pose.size(); ++c) {
    pose[c] += of_position * offset_[c] + of_velocity * velocity_[c];
  }
}

}  // namespace posed::generate
