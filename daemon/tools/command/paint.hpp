// Shared by the full-screen views: colours, and text cut or broken to a number of columns (it is
// ASCII).
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace posed::tools {

inline constexpr const char* kRed = "\x1b[31m";
inline constexpr const char* kGreen = "\x1b[32m";
inline constexpr const char* kYellow = "\x1b[33m";
inline constexpr const char* kDim = "\x1b[2m";
inline constexpr const char* kBold = "\x1b[1m";

// `colour` "" means no colour.
[[nodiscard]] inline std::string paint(bool coloured, const char* colour, const std::string& text) {
  return coloured && *colour != '\0' ? colour + text + "\x1b[0m" : text;
}

// Cuts to `width` columns (at least one); a "~" at the end shows that something was cut.
[[nodiscard]] inline std::string cut(const std::string& text, int width) {
  const std::size_t columns = width < 1 ? 1 : width;
  return text.size() <= columns ? text : text.substr(0, columns - 1) + "~";
}

// Splits the text at blanks into lines of at most `width`; a longer word is cut. Lines after the
// first begin with `indent`.
[[nodiscard]] inline std::vector<std::string> wrapped(std::string_view text, int width,
                                                      const std::string& indent = {}) {
  std::vector<std::string> lines(1);
  bool empty = true;  // the last line has no word yet
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string word(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (empty || lines.back().size() + 1 + word.size() <= static_cast<std::size_t>(width)) {
      lines.back() += (empty ? "" : " ") + word;
    } else {
      lines.push_back(indent + word);
    }
    empty = false;
  }
  for (std::string& line : lines) line = cut(line, width);
  return lines;
}

}  // namespace posed::tools
