// Converts a device's time to the host's.
#pragma once

#include <cstdint>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed {

// The host time that corresponds to a device time.
RT_SAFE [[nodiscard]] constexpr std::int64_t to_host_ns(const ClockMapping& clock,
                                                        std::int64_t device_ns) noexcept {
  const double since_ns = static_cast<double>(device_ns - clock.origin_ns);
  return device_ns + clock.offset_ns +
         static_cast<std::int64_t>(static_cast<double>(clock.drift_ppm) * 1e-6 * since_ns);
}

}  // namespace posed
