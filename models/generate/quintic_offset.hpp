// The return from a performance to the live hand (models/generate/README.md, "Return to the live
// hand"). RT-safe except for construction.
#pragma once

#include <span>
#include <vector>

namespace posed::generate {

// An offset that decays from an initial position and velocity to zero along a polynomial of fifth
// degree, which starts without acceleration and ends at rest. Added to the live pose, it leads back
// to it.
class QuinticOffset {
 public:
  // Allocates for poses of at most `channels` channels.
  explicit QuinticOffset(int channels)
      : offset_(static_cast<std::size_t>(channels)),
        velocity_(static_cast<std::size_t>(channels)) {}

  // [channel]; `velocity` is in radians per frame; the offset is zero after `frames` frames.
  void start(std::span<const double> offset, std::span<const double> velocity, int frames) noexcept;

  // Adds the next frame's offset to a pose, the first call that of a frame after the start; zero
  // when done().
  void add_next(std::span<double> pose) noexcept;
  [[nodiscard]] bool done() const noexcept { return frame_ >= frames_; }

 private:
  std::vector<double> offset_, velocity_;
  int frame_ = 0, frames_ = 0;
};

}  // namespace posed::generate
