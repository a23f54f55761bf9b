// A look at TOML before it is parsed. toml++ nests one table for each part of a dotted key, without
// a limit, and ends such a chain of tables by recursion: 62 KB of "a.a.a..." overflow its stack. So
// nothing is parsed that this has not passed. Cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed {

// How much TOML one kind of file may hold.
struct TomlLimits {
  std::string_view what = "file";  // names the kind in sentences: "calibration"
  std::size_t bytes = 64 * 1024;
  int depth = 8;  // parts of the header and of the key, and brackets and braces, added up
  std::size_t items = 4096;  // keys, table headers and commas
};

// An Error with the line where a limit is passed. Comments and strings are stepped over as TOML 1.0
// reads them; of a text that is not TOML it may say anything, but never passes what toml++ would
// nest deeper. Uses no recursion, one pass, and memory of at most `depth` levels.
[[nodiscard]] Result<> check_toml(std::string_view text, const std::string& file,
                                  const TomlLimits& limits);

}  // namespace posed
