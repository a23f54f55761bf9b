// The timecode that emulated devices send.
#pragma once

#include <cstdint>

#include "proto/frame/time.hpp"

namespace posed::drivers::emulate {

// Of a generator of 30 frames per second that shows one hour at the start: hours, minutes, seconds
// and frames, the hours in the highest byte.
[[nodiscard]] constexpr std::uint32_t timecode_at(std::int64_t time_ns) noexcept {
  const auto frames = static_cast<std::uint32_t>(time_ns / (kNanosPerSecond / 30));
  const std::uint32_t all_seconds = frames / 30;
  const std::uint32_t hours = 1 + all_seconds / 3600;
  return (hours % 24) << 24 | (all_seconds / 60 % 60) << 16 | (all_seconds % 60) << 8 | frames % 30;
}

}  // namespace posed::drivers::emulate
