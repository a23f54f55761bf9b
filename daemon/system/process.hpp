// What this process uses of the machine. Cold.
#pragma once

#include <cstdint>

namespace posed::system {

[[nodiscard]] std::uint64_t resident_bytes();
// CPU time of all its threads since it began.
[[nodiscard]] std::int64_t cpu_time_ns();

}  // namespace posed::system
