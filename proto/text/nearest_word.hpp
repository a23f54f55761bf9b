// Suggestions for mistyped words.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace posed {

// Returns the entry of `known` that `word` most likely means: the nearest by edit distance, if at
// most one letter plus a quarter of its letters differ; otherwise empty. Two swapped letters count
// as one.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

// All words of a range with `separator` between them.
template <typename Words>
[[nodiscard]] std::string listed(const Words& words, std::string_view separator) {
  std::string all;
  for (const auto& word : words) {
    if (!all.empty()) all += separator;
    all += word;
  }
  return all;
}

}  // namespace posed
