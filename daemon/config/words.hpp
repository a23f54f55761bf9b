// Words that people mistype.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "proto/text/clean.hpp"

namespace posed::config {

// The one of `known` that `word` is a misspelling of: the nearest by edit distance, when no more
// than one letter and a quarter of it differ; else empty.
[[nodiscard]] std::string nearest(std::string_view word, const std::set<std::string>& known);

// Older names of the cleaning in proto/text/clean.hpp.
[[nodiscard]] inline std::string without_controls(std::string_view text) { return clean(text); }
[[nodiscard]] inline std::string printable(std::string_view text) { return clean_name(text); }

}  // namespace posed::config
