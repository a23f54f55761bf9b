// Words that people mistype, and words of strangers that a terminal should not obey.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace posed::config {

// The one of `known` nearest to `word` by edit distance; empty when `known` is.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

// `text` with '?' for every control character: on one line, and nothing that a terminal obeys.
[[nodiscard]] std::string without_controls(std::string text);

// The same, and not too long.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace posed::config
