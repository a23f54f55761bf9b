// The word of --hand.
#pragma once

#include <string_view>

#include "proto/frame/hand.hpp"

namespace posed::tools {

// `word` is "left" or "right"; CLI11 has refused all others.
[[nodiscard]] constexpr Side side_named(std::string_view word) noexcept {
  return word == "left" ? Side::kLeft : Side::kRight;
}

}  // namespace posed::tools
