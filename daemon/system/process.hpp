// Resources that this process uses. Cold.
#pragma once

#include <cstdint>

namespace posed::system {

[[nodiscard]] std::uint64_t resident_bytes();
// The CPU time of all threads since the process began.
[[nodiscard]] std::int64_t cpu_time_ns();
// When the process began [s], in UTC since 1970; 0 if the system does not know.
[[nodiscard]] double start_time_s();

}  // namespace posed::system
