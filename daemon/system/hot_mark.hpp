// Marks with which the hot threads declare where the real-time contract holds: no allocation, lock,
// log or exception, and no system call except the read, the wait and the eventfd write. Setting a
// mark costs one byte store. The rt test checks the marked code, and passes the address of
// no_syscalls to the kernel, which then reports every system call that is made while it is 1.
#pragma once

#include <cstdint>

namespace posed::system {

struct HotMarks {
  volatile std::uint8_t contract = 0;     // 1: no allocation, lock, log or throw allowed
  volatile std::uint8_t no_syscalls = 0;  // 1: no system call allowed either
};
inline constinit thread_local HotMarks hot_marks;

class [[nodiscard]] HotSection {
 public:
  HotSection() noexcept {
    hot_marks.contract = 1;
    hot_marks.no_syscalls = 1;
  }
  ~HotSection() {
    hot_marks.no_syscalls = 0;
    hot_marks.contract = 0;
  }
  HotSection(const HotSection&) = delete;
  HotSection& operator=(const HotSection&) = delete;
};

// Encloses the one system call that the contract allows: the read, the wait or the eventfd write.
class [[nodiscard]] AllowedCall {
 public:
  AllowedCall() noexcept { hot_marks.no_syscalls = 0; }
  ~AllowedCall() { hot_marks.no_syscalls = hot_marks.contract; }
  AllowedCall(const AllowedCall&) = delete;
  AllowedCall& operator=(const AllowedCall&) = delete;
};

}  // namespace posed::system
