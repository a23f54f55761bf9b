// Whether a connection begins like that of a web browser. A page can make a browser of this machine
// connect to any local port and send text; what a browser sends begins with the line of an HTTP
// request or a TLS handshake, and no device's protocol does.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers {

enum class Beginning : std::uint8_t { kOpen, kDevice, kBrowser };

inline constexpr std::size_t kMaxBeginning = 8;  // bytes that decide at the latest

// kOpen: more bytes must come to know.
RT_SAFE [[nodiscard]] inline Beginning beginning_of(std::span<const std::byte> bytes) noexcept {
  using std::string_view_literals::operator""sv;
  constexpr std::array kWords{"GET "sv,   "POST "sv,  "PUT "sv,     "OPTIONS "sv,
                              "HEAD "sv,  "PRI "sv,   "CONNECT "sv, "DELETE "sv,
                              "PATCH "sv, "TRACE "sv, "\x16\x03"sv};
  bool open = bytes.empty();
  for (const std::string_view word : kWords) {
    const std::size_t size = std::min(word.size(), bytes.size());
    const bool same = std::ranges::equal(
        bytes.first(size), word.substr(0, size), {}, [](std::byte byte) { return byte; },
        [](char letter) { return static_cast<std::byte>(letter); });
    if (same && size == word.size()) return Beginning::kBrowser;
    open = open || same;
  }
  return open ? Beginning::kOpen : Beginning::kDevice;
}

// FirstLines: whether a line at the beginning of a connection is that of a request, by its end: a
// page whose own name points to this machine may choose the method, so that the line begins as a
// device's.
class FirstLines {
 public:
  // Takes the next bytes. Returns true if a line has ended, in these, as a request's does.
  RT_SAFE [[nodiscard]] bool have_request(std::span<const std::byte> bytes) noexcept {
    for (const std::byte byte : bytes.first(std::min(bytes.size(), left_))) {
      if (byte == std::byte{'\n'} && is_end()) return true;
      end_[at_++ % end_.size()] = byte;
    }
    left_ -= std::min(bytes.size(), left_);
    return false;
  }

 private:
  static constexpr std::string_view kEnd = " HTTP/1.1\r";

  RT_SAFE [[nodiscard]] bool is_end() const noexcept {
    for (std::size_t i = 0; i < kEnd.size(); ++i) {
      if (end_[(at_ + i) % kEnd.size()] != static_cast<std::byte>(kEnd[i])) return false;
    }
    return true;
  }

  std::array<std::byte, kEnd.size()> end_{};  // the newest bytes, the oldest at at_
  std::size_t at_ = 0, left_ = 64 * 1024;     // no browser writes a longer line
};

}  // namespace posed::drivers
