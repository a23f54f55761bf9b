// Checks the real-time contract: while a thread's hot marks are set (daemon/system/hot_mark.hpp),
// each allocation, lock, log call, throw and system call is counted. Heap, locks and throw are
// observed by functions that replace the library's; log calls by a sink; system calls by the kernel
// (syscall user dispatch, Linux 5.11, no privileges needed).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

namespace posed::rt {

enum class Breach : std::uint8_t { kAllocation, kLock, kLog, kThrow, kSystemCall, kCount };
inline constexpr std::array<std::string_view, 5> kBreachNames{"allocation", "lock", "log call",
                                                              "throw", "system call"};

// Violations so far, of all threads.
[[nodiscard]] std::uint64_t breaches(Breach breach) noexcept;
// The number of the last forbidden system call; -1 when there was none.
[[nodiscard]] long last_system_call() noexcept;
void forget_breaches() noexcept;

// Makes a logger that counts spdlog's default logger, at every level.
void watch_log();
// From now on the kernel reports forbidden system calls of the calling thread. Returns false if the
// kernel cannot; the other violations are still counted.
[[nodiscard]] bool watch_system_calls() noexcept;

}  // namespace posed::rt
