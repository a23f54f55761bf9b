// GloveEmulator: the base of all emulated gloves. Its one body is a hand.
#pragma once

#include <optional>
#include <string_view>

#include "drivers/emulator.hpp"
#include "drivers/glove/calibration.hpp"
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

// The raw value that this sensor has in a pose, by its first entry in the angle map; none for a
// sensor that moves nothing. Cold.
[[nodiscard]] std::optional<double> raw_of_pose(const Calibration& calibration, std::size_t sensor,
                                                const HandAngles& angles);

// Appends text to the bytes that an emulator sends. Cold.
void add_text(std::string_view text, Emulator::Bytes& out);

// A frame of a hand with these angles, for an emulator. Cold.
[[nodiscard]] Frame hand_frame(const HandAngles& angles);

}  // namespace posed::drivers::glove
