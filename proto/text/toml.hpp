// The only way to parse TOML, which may be untrusted. The text is checked for size and depth before
// it is parsed; the first error rejects the whole text. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include "proto/frame/result.hpp"

namespace posed {

// Limits for one kind of TOML file.
struct TomlLimits {
  std::string_view what = "file";  // the kind in error messages, for example "calibration"
  std::size_t bytes = 64 * 1024;
  int depth = 8;             // parts of the header and the key plus open brackets and braces
  std::size_t items = 4096;  // keys, table headers and commas
};

// toml++ nests one table for each part of a dotted key, without a limit, and destroys such a chain
// of tables by recursion: 62 KB of "a.a.a..." overflow its stack. Therefore every text passes this
// check before it is parsed.
//
// Returns an Error with the line where a limit is exceeded. Comments and strings are skipped as
// TOML 1.0 defines them. A text that is not TOML may pass or fail, but one that toml++ would
// nest deeper never passes. No recursion, one pass, memory for at most `depth` levels.
Result<> check_toml(std::string_view text, const std::string& file, const TomlLimits& limits);

// Returns the table of a text that stays within `limits`; `file` is the name in an Error. Throws
// nothing. The table is shallow enough to be walked and destroyed by recursion.
Result<toml::table> parse_toml(std::string_view text, const std::string& file,
                               const TomlLimits& limits);

// Reads and parses a file, whose size is limited by limits.bytes.
Result<toml::table> load_toml(const std::filesystem::path& path, const TomlLimits& limits);

}  // namespace posed
