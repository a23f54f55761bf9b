// The daemon's clock: CLOCK_MONOTONIC. It is passed as a parameter to everything that needs the
// time, so that tests can use another one.
#pragma once

#include <cstdint>
#include <ctime>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

RT_SAFE inline std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNanosPerSecond + now.tv_nsec;
}

}  // namespace posed::system
