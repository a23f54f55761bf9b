// Decodes each packet of the bend sensor into a frame (palm and finger) and a sample (bend,
// battery).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/driver.hpp"
#include "drivers/template/protocol.hpp"

namespace posed::drivers::bend {

class BendDecoder final : public Decoder {
 public:
  BendDecoder(std::shared_ptr<const Skeleton> skeleton, double rate_hz)
      : skeleton_(std::move(skeleton)), period_ns_(1e9 / rate_hz) {}

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 private:
  void take_packet(Sink& sink) noexcept;
  void resynchronise() noexcept;
  void emit(const Packet& packet, Sink& sink) noexcept;
  // Turns the packet counter into a time that does not wrap.
  [[nodiscard]] std::int64_t device_time_ns(std::uint8_t count) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  double period_ns_;
  std::array<std::byte, kPacketBytes> pending_{};  // the packet being collected
  std::size_t pending_bytes_ = 0;
  bool in_step_ = true;  // false while searching for a start; one outcome per search, not per byte
  bool has_count_ = false;
  std::uint8_t count_ = 0;    // of the last packet
  std::int64_t packets_ = 0;  // sent by the device since the first one received
};

}  // namespace posed::drivers::bend
