// GloveEmulator: the base of all emulated gloves. Its one body is a hand.
#pragma once

#include "drivers/emulator.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

class GloveEmulator : public Emulator {
 public:
  // Takes the frame of a hand skeleton; an angle that it does not have is zero.
  void pose(std::size_t body, const Frame& frame) final;

 protected:
  // Sets the hand pose from now on [rad].
  virtual void pose_hand(const HandAngles& angles) = 0;
};

// A frame of a hand with these angles, for an emulator. Cold.
[[nodiscard]] Frame hand_frame(const HandAngles& angles);

}  // namespace posed::drivers::glove
