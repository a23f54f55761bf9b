// The hot marks: how the hot threads say where the hot law holds (no allocation, lock, log, throw,
// or system call but the read, the wait and the eventfd write). They cost a byte store each; the rt
// test watches them, and hands the address of no_syscalls to the kernel, which then reports every
// system call made while it is 1.
#pragma once

#include <cstdint>

namespace posed::pipeline {

struct HotMarks {
  volatile std::uint8_t law = 0;          // 1: no allocation, lock, log or throw
  volatile std::uint8_t no_syscalls = 0;  // 1: no system call either
};
inline constinit thread_local HotMarks hot_marks;

class [[nodiscard]] HotSection {
 public:
  HotSection() noexcept {
    hot_marks.law = 1;
    hot_marks.no_syscalls = 1;
  }
  ~HotSection() {
    hot_marks.no_syscalls = 0;
    hot_marks.law = 0;
  }
  HotSection(const HotSection&) = delete;
  HotSection& operator=(const HotSection&) = delete;
};

// Around the one system call that the law allows: the read, the wait or the eventfd write.
class [[nodiscard]] AllowedCall {
 public:
  AllowedCall() noexcept { hot_marks.no_syscalls = 0; }
  ~AllowedCall() { hot_marks.no_syscalls = hot_marks.law; }
  AllowedCall(const AllowedCall&) = delete;
  AllowedCall& operator=(const AllowedCall&) = delete;
};

}  // namespace posed::pipeline
