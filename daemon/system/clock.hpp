// The daemon's clock: CLOCK_MONOTONIC. Handed down to whatever must know the time.
#pragma once

#include <cstdint>
#include <ctime>

#include "proto/frame/time.hpp"

namespace posed::system {

// RT-safe
inline std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNanosPerSecond + now.tv_nsec;
}

}  // namespace posed::system
