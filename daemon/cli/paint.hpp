// Shared by the full-screen views: colours, and text cut to a number of columns (names are ASCII).
#pragma once

#include <cstddef>
#include <string>

namespace posed::cli {

inline constexpr const char* kRed = "\x1b[31m";
inline constexpr const char* kYellow = "\x1b[33m";
inline constexpr const char* kDim = "\x1b[2m";
inline constexpr const char* kBold = "\x1b[1m";

// `colour` "" means no colour.
[[nodiscard]] inline std::string paint(bool coloured, const char* colour, const std::string& text) {
  return coloured && *colour != '\0' ? colour + text + "\x1b[0m" : text;
}

// Cuts to `width` columns (at least one); a "~" at the end shows that something was cut.
[[nodiscard]] inline std::string cut(const std::string& text, int width) {
  const auto columns = static_cast<std::size_t>(width < 1 ? 1 : width);
  return text.size() <= columns ? text : text.substr(0, columns - 1) + "~";
}

}  // namespace posed::cli
