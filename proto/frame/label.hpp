// The name of a gesture, short enough for label files, play commands, models and frames.
#pragma once

#include <algorithm>
#include <string_view>

#include "proto/frame/frame.hpp"

namespace posed {

// 1 to 15 ASCII characters, without blanks.
[[nodiscard]] constexpr bool is_label_name(std::string_view name) noexcept {
  return !name.empty() && name.size() < kMaxLabel &&
         std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < '\x7F'; });
}

}  // namespace posed
