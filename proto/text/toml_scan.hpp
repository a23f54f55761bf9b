// Checks TOML before it is parsed. toml++ nests one table for each part of a dotted key, without a
// limit, and destroys such a chain of tables by recursion: 62 KB of "a.a.a..." overflow its stack.
// Therefore every text passes this check before it is parsed. Cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed {

// Limits for one kind of TOML file.
struct TomlLimits {
  std::string_view what = "file";  // the kind in error messages, for example "calibration"
  std::size_t bytes = 64 * 1024;
  int depth = 8;  // parts of the header and of the key, and brackets and braces, added up
  std::size_t items = 4096;  // keys, table headers and commas
};

// Returns an Error with the line where a limit is exceeded. Comments and strings are skipped as
// TOML 1.0 defines them. For a text that is not TOML the result may be either, but it never accepts
// a text that toml++ would nest deeper. No recursion, one pass, memory for at most `depth` levels.
[[nodiscard]] Result<> check_toml(std::string_view text, const std::string& file,
                                  const TomlLimits& limits);

}  // namespace posed
