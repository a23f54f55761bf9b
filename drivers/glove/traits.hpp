// GloveTraits: what a driver of a glove adds to its Driver. Its decoder is a GloveDecoder.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/known_usb.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

// A control message for a glove with motors, in units of the hand.
struct Haptics {
  std::array<float, kFingers> force{};  // thumb to little: 0 free, 1 blocked, negative unchanged
  float vibration_hz = 0.0F;
  float vibration_s = 0.0F;  // 0: no vibration
  float vibration = 0.0F;    // amplitude, 0 to 1
};

struct GloveTraits {
  // The sensors of the glove and their meaning before calibration.
  Result<Model> (*glove_model)(const Description& description);
  // Encodes a haptics message for the device; null for a glove without motors.
  Result<std::vector<std::byte>> (*encode_haptics)(const Options& options,
                                                   const Haptics& haptics) = nullptr;
  // The USB ids by which the glove, or the chip that it is connected to, is known.
  std::span<const KnownUsb> usb{};
  // The largest share of damaged packets that its framing takes for good ones. The noise test holds
  // the decoder to it.
  double undetected = 0.0;
};

}  // namespace posed::drivers::glove
