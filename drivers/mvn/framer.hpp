// Framer: finds MVN's datagrams in the byte stream of a TCP connection. The head tells how long the
// payload is. After damage it goes on at the next head.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

class Framer {
 public:
  // The longest payload over TCP. The longest that is known describes 123 points of a character
  // (type 13) and has about 5 KB.
  static constexpr std::size_t kMaxPayload = std::size_t{16} * 1024;

  // Reads bytes cut at any position. `handle` gets each datagram, and empty bytes once for each run
  // of bytes that are none.
  template <typename Handle>
  RT_SAFE void feed(std::span<const std::byte> bytes, Handle&& handle) noexcept {
    while (!bytes.empty()) {
      const std::size_t used = std::min(bytes.size(), buffer_.size() - size_);
      std::ranges::copy(bytes.first(used), buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
      size_ += used;
      bytes = bytes.subspan(used);
      split(handle);
    }
  }

 private:
  // Takes all whole datagrams out of the buffer. Afterwards it has room: what is left is shorter
  // than one datagram.
  template <typename Handle>
  void split(Handle& handle) noexcept {
    std::size_t at = 0;
    while (at < size_) {
      const std::span<const std::byte> rest = std::span(buffer_).subspan(at, size_ - at);
      const Next next = look(rest);
      if (next.skip > 0) {
        if (!skipping_) handle(std::span<const std::byte>{});
        skipping_ = true;
        at += next.skip;
        continue;
      }
      if (next.whole == 0) break;
      skipping_ = false;
      handle(rest.first(next.whole));
      at += next.whole;
    }
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(at),
              buffer_.begin() + static_cast<std::ptrdiff_t>(size_), buffer_.begin());
    size_ -= at;
  }

  struct Next {
    std::size_t skip = 0;   // bytes that begin no datagram
    std::size_t whole = 0;  // bytes of the datagram at the start; both 0: more must come
  };
  [[nodiscard]] static Next look(std::span<const std::byte> bytes) noexcept;

  std::array<std::byte, kHeadBytes + kMaxPayload> buffer_{};
  std::size_t size_ = 0;
  bool skipping_ = false;
};

}  // namespace posed::drivers::mvn
