// Emulator: simulates a device. It holds the device's command set and state, is given the poses of
// its bodies and produces the bytes that the real device would send. Pure: no clock, no I/O, so
// that tests, the demo and `posed emulate` drive the same object at any speed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers {

class Emulator {
 public:
  using Bytes = std::vector<std::byte>;

  Emulator() = default;
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;
  virtual ~Emulator() = default;

  // Returns the skeleton of one of its bodies, as the host will learn it; null for a hand and for a
  // body that it does not have. It never changes.
  [[nodiscard]] virtual const Skeleton* skeleton(std::size_t /*body*/) const { return nullptr; }

  // Adds a person behind its bodies, if the device can have one more; only before the first record.
  virtual bool add_person() { return false; }

  // Sets the pose of one of its bodies from now on: a frame of that skeleton, or of a hand
  // (proto/frame/hand_skeleton.hpp). A body that it does not have is ignored.
  virtual void pose(std::size_t body, const Frame& frame) = 0;

  // Receives bytes from the host: of a byte stream cut at any position, of UDP one datagram.
  // Immediate answers are added to `answer`. Most devices take nothing.
  virtual void receive(std::span<const std::byte> /*bytes*/, std::int64_t /*now_ns*/,
                       Bytes& /*answer*/) {}

  // Receives bytes as receive() does, for a device with several sockets: they come from this socket
  // of the host, and the answer goes there.
  virtual void receive_socket(std::uint8_t /*socket*/, std::span<const std::byte> bytes,
                              std::int64_t now_ns, Bytes& answer) {
    receive(bytes, now_ns, answer);
  }

  // Time at which the next record is due; kNoTime_ns while the device does not stream.
  [[nodiscard]] virtual std::int64_t next_due_ns() const = 0;

  // The socket of the host that this record goes to.
  [[nodiscard]] virtual std::uint8_t next_socket() const { return 0; }

  // [socket of the host] The device's port that it sends to; 0: that which the records come from,
  // whatever it is.
  [[nodiscard]] virtual std::vector<std::uint16_t> ports() const { return {0}; }

  // Adds what is due now to `out`: one packet of the device, or one of each kind if it has several.
  virtual void emit(std::int64_t now_ns, Bytes& out) = 0;
};

}  // namespace posed::drivers
