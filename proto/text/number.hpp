// Numbers in texts that hold nothing else, whatever the locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

#include "proto/frame/rt_safe.hpp"

namespace posed {

// The number that all of the text is; empty for any other text, with a leading '+' or blanks too,
// and for a number that T cannot hold. A double may be infinite or NaN.
template <typename T>
RT_SAFE [[nodiscard]] std::optional<T> exact_number(std::string_view text) noexcept {
  T number{};
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  const auto [stop, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

}  // namespace posed
