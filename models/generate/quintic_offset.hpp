// The return from a performance to the live hand (models/generate/README.md, "Return to the live
// hand"). Only arithmetic on hand45 angles, RT-safe.
#pragma once

#include "proto/frame/hand.hpp"

namespace posed::generate {

// An offset that decays from an initial position and velocity to zero along a polynomial of fifth
// degree, which starts without acceleration and ends at rest. Added to the live hand, it leads back
// to it.
class QuinticOffset {
 public:
  // `velocity` is in radians per frame; the offset is zero after `frames` frames.
  void start(const HandAngles& offset, const HandAngles& velocity, int frames) noexcept;

  // The next frame's offset, the first call gives the one a frame after the start; zero when
  // done().
  [[nodiscard]] HandAngles next() noexcept;
  [[nodiscard]] bool done() const noexcept { return frame_ >= frames_; }

 private:
  HandAngles offset_{}, velocity_{};
  int frame_ = 0, frames_ = 0;
};

}  // namespace posed::generate
