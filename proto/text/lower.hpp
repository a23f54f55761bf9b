#pragma once

#include <string>
#include <string_view>

namespace posed {

// Returns `text` with A to Z in lower case and all other bytes as they are, in any locale.
[[nodiscard]] inline std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

}  // namespace posed
