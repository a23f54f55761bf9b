// Words that people mistype, and words of strangers that a terminal should not obey.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace posed::config {

// The one of `known` nearest to `word` by edit distance; empty when `known` is.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

// `text` on one line and not too long: control characters become '?'.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace posed::config
