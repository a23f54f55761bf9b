// Emulator: simulates a device. It holds the device's command set and state, takes a hand pose and
// produces the bytes that the real device would send. Pure: no clock, no I/O, so that tests, the
// demo and `posed emulate` drive the same object at any speed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "proto/frame/hand.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

class Emulator {
 public:
  using Bytes = std::vector<std::byte>;

  Emulator() = default;
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;
  virtual ~Emulator() = default;

  // Sets the hand pose from now on [rad].
  virtual void pose(const HandAngles& angles) = 0;

  // Takes bytes from the host, cut at any position; immediate answers are added to `answer`.
  virtual void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) = 0;

  // Time at which the next record is due; kNoTime_ns while the device does not stream.
  [[nodiscard]] virtual std::int64_t next_due_ns() const = 0;

  // Adds the record that is due now to `out`: one packet of the device.
  virtual void emit(std::int64_t now_ns, Bytes& out) = 0;
};

}  // namespace posed::drivers
