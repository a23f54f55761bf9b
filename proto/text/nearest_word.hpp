// Suggestions for mistyped words.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace posed {

// Returns the entry of `known` that `word` most likely means: the nearest by edit distance, if at
// most one letter plus a quarter of its letters differ; otherwise empty.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

}  // namespace posed
