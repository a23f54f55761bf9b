// A row of bars from a list of numbers, one character each, for a terminal.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace posed::tools {

// The tallest of the eight bars is the largest value. What is not above 0, or not finite, is the
// lowest bar.
[[nodiscard]] inline std::string sparkline(const std::vector<double>& values) {
  const auto height = [](double value) {
    return std::isfinite(value) ? std::max(value, 0.0) : 0.0;
  };
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, height(value));
  std::string text;
  for (const double value : values) {
    const double part = largest > 0.0 ? height(value) / largest : 0.0;
    text += "\xe2\x96";  // U+2581 to U+2588 in UTF-8
    text += static_cast<char>(0x81 + std::lround(part * 7.0));
  }
  return text;
}

}  // namespace posed::tools
