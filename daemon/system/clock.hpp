// The daemon's clock: CLOCK_MONOTONIC. It is passed as a parameter to everything that needs the
// time, so that tests can use another one.
#pragma once

#include <cstdint>
#include <ctime>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

RT_SAFE inline std::int64_t clock_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNanosPerSecond + now.tv_nsec;
}

RT_SAFE inline std::int64_t monotonic_ns() noexcept { return clock_ns(CLOCK_MONOTONIC); }

}  // namespace posed::system
