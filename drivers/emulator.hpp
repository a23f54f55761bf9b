// Emulator: a device's other side. It keeps the device's command set and state, takes a hand's pose
// and gives the bytes that the real device would send. Pure: no clock, no I/O, so that tests, the
// demo and `posed emulate` drive the same object at any pace.
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

  // How the hand stands from now on [rad].
  virtual void pose(const HandAngles& angles) = 0;

  // Bytes from the host, in any cut; what the device answers at once is added to `answer`.
  virtual void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) = 0;

  // When the next record is due; kNoTime_ns while the device does not stream.
  [[nodiscard]] virtual std::int64_t next_due_ns() const = 0;

  // The record that is due now, added to `out`: one packet of the device.
  virtual void emit(std::int64_t now_ns, Bytes& out) = 0;
};

}  // namespace posed::drivers
