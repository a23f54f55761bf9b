// FirstBytes: whether a connection begins like that of a web browser. A page can make a browser of
// this machine connect to any local port and send text; what a browser sends begins with the method
// of HTTP or a TLS handshake, and no device's protocol does.
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

}  // namespace posed::drivers
