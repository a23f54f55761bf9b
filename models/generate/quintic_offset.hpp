// The way back from a performance to the live hand (models/generate/README.md, "Return to the live
// hand"). Pure arithmetic on hand45 angles, RT-safe.
#pragma once

#include "proto/frame/hand.hpp"

namespace posed::generate {

// An offset that decays from a position and a velocity to nothing, as a polynomial of fifth degree:
// it begins without acceleration and ends at rest. Added to a live hand it leads back to it.
class QuinticOffset {
 public:
  // `velocity` in radians a frame; the offset is gone after `frames`.
  void start(const HandAngles& offset, const HandAngles& velocity, int frames) noexcept;

  // The next frame's offset, the first one frame after the start; zero when done().
  [[nodiscard]] HandAngles next() noexcept;
  [[nodiscard]] bool done() const noexcept { return frame_ >= frames_; }

 private:
  HandAngles offset_{}, velocity_{};
  int frame_ = 0, frames_ = 0;
};

}  // namespace posed::generate
