// The look that all figures of a report share: colours that colour-blind people can tell apart
// (Okabe and Ito), each with a mark and a dash pattern of its own, so that a grey print is
// readable, too. The page's style sheet gives the colours, lighter ones where the reader prefers
// dark. Cold.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "proto/text/svg.hpp"

namespace posed::report {

inline constexpr std::size_t kSeries = 7;

// A series' class in the style sheet: "s0" to "s6".
[[nodiscard]] inline std::string series_class(std::size_t series) {
  return "s" + std::to_string(series % kSeries);
}

[[nodiscard]] inline std::string_view dashes(std::size_t series) {
  constexpr std::array<std::string_view, kSeries> kDashes{"",    "7 4",     "2 3", "10 3 2 3",
                                                          "4 2", "1 2 6 2", "12 5"};
  return kDashes[series % kSeries];
}

// ` name="1.0"`
[[nodiscard]] inline std::string attribute(std::string_view name, double value) {
  return " " + std::string(name) + "=\"" + svg_number(value) + "\"";
}

// About the width of text in a figure.
[[nodiscard]] inline double text_px(std::string_view text) {
  constexpr double kLetter_px = 7.3;
  std::size_t letters = 0;  // of UTF-8
  for (const char c : text) letters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return kLetter_px * static_cast<double>(letters);
}

}  // namespace posed::report
