// What the drawn screens share: colours, and text cut to a number of columns (names are ASCII).
#pragma once

#include <cstddef>
#include <string>

namespace posed::cli {

inline constexpr const char* kRed = "\x1b[31m";
inline constexpr const char* kYellow = "\x1b[33m";
inline constexpr const char* kDim = "\x1b[2m";
inline constexpr const char* kBold = "\x1b[1m";

// `colour` "" is none.
[[nodiscard]] inline std::string paint(bool coloured, const char* colour, const std::string& text) {
  return coloured && *colour != '\0' ? colour + text + "\x1b[0m" : text;
}

// At most `width` columns, of which there is at least one; a "~" says that something is left out.
[[nodiscard]] inline std::string cut(const std::string& text, int width) {
  const auto columns = static_cast<std::size_t>(width < 1 ? 1 : width);
  return text.size() <= columns ? text : text.substr(0, columns - 1) + "~";
}

}  // namespace posed::cli
