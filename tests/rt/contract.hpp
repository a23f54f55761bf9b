// The real-time contract, enforced: while a thread's hot marks are set
// (daemon/system/hot_mark.hpp), each allocation, lock, log call, throw and system call is counted
// here. The heap, the locks and throw are watched by functions that stand before the library's own;
// log calls by a sink; system calls by the kernel (syscall user dispatch, Linux 5.11, no rights
// needed).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

namespace posed::rt {

enum class Breach : std::uint8_t { kAllocation, kLock, kLog, kThrow, kSystemCall, kCount };
inline constexpr std::array<std::string_view, 5> kBreachNames{"allocation", "lock", "log call",
                                                              "throw", "system call"};

// Breaches so far, of all threads.
[[nodiscard]] std::uint64_t breaches(Breach breach) noexcept;
// The number of the last forbidden system call; -1 when there was none.
[[nodiscard]] long last_system_call() noexcept;
void forget_breaches() noexcept;

// Makes spdlog's default logger one that counts, at every level.
void watch_log();
// From here on the kernel reports the calling thread's forbidden system calls. False when it
// cannot; the other classes are watched anyway.
[[nodiscard]] bool watch_system_calls() noexcept;

}  // namespace posed::rt
