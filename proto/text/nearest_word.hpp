// Words that people mistype.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace posed {

// The one of `known` that `word` is a misspelling of: the nearest by edit distance, when no more
// than one letter and a quarter of it differ; else empty.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

}  // namespace posed
