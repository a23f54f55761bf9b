// Resources that this process uses. Cold.
#pragma once

#include <cstdint>

namespace posed::system {

[[nodiscard]] std::uint64_t resident_bytes();
// CPU time of all threads since the process began.
[[nodiscard]] std::int64_t cpu_time_ns();

}  // namespace posed::system
