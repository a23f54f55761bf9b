// Tape: the recorder as the hot threads see it. Both calls copy into a ring and return; the
// recorder thread drains on its own timer, so recording costs the hot path no system call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/pipeline/messages.hpp"

namespace posed::record {

enum class Direction : std::uint8_t { kFromDevice = 0, kToDevice = 1 };

class Tape {
 public:
  Tape() = default;
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;
  virtual ~Tape() = default;

  // Reader thread, before decoding. A full ring is counted and becomes a gap row and an event.
  // RT-safe.
  virtual void chunk(std::uint32_t stream, Direction direction, std::int64_t arrival_ns,
                     std::span<const std::byte> bytes) noexcept = 0;
  // Pipeline thread. RT-safe.
  virtual void decision(const pipeline::Decision& decision) noexcept = 0;
};

}  // namespace posed::record
