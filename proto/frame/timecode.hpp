// The timecode that a stage's generator gives to all its devices, as text. RT-safe.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace posed {

inline constexpr int kMaxTimecode = 16;  // bytes, including the closing zero

// "hh:mm:ss:ff" (SMPTE 12M), or "hh:mm:ss.mmm"; empty: there is none. Closed by zeros.
using Timecode = std::array<char, kMaxTimecode>;

// Returns the timecode in `text`; empty where the text has neither form.
[[nodiscard]] constexpr Timecode to_timecode(std::string_view text) noexcept {
  constexpr std::string_view kFrames = "dd:dd:dd:dd", kMilliseconds = "dd:dd:dd.ddd";
  const auto has_form = [text](std::string_view form) {
    const auto fits = [](char c, char wanted) {
      return wanted == 'd' ? c >= '0' && c <= '9' : c == wanted;
    };
    return std::ranges::equal(text, form, fits);
  };
  Timecode timecode{};
  if (has_form(kFrames) || has_form(kMilliseconds)) std::ranges::copy(text, timecode.begin());
  return timecode;
}

// Unpacks hours, minutes, seconds and frames, the hours in the highest byte. Returns an empty
// timecode when a number is out of range or all are 0, which devices without timecode send.
[[nodiscard]] constexpr Timecode to_timecode(std::uint32_t packed) noexcept {
  constexpr std::array<std::uint32_t, 4> kMaxOfField{23, 59, 59, 99};
  Timecode timecode{};
  if (packed == 0) return timecode;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t number = (packed >> (24 - 8 * i)) & 0xFFU;
    if (number > kMaxOfField[i]) return {};
    timecode[3 * i] = static_cast<char>('0' + number / 10);
    timecode[3 * i + 1] = static_cast<char>('0' + number % 10);
    if (i < 3) timecode[3 * i + 2] = ':';
  }
  return timecode;
}

[[nodiscard]] constexpr std::string_view view_of(const Timecode& timecode) noexcept {
  return {timecode.begin(), std::ranges::find(timecode, '\0')};
}

}  // namespace posed
