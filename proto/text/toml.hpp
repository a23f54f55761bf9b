// The only way to parse TOML, which may be untrusted. The text is checked for size and depth before
// it is parsed; the first error rejects the whole text. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include "proto/frame/result.hpp"
#include "proto/text/toml_scan.hpp"

namespace posed {

// Returns the table of a text that stays within `limits`; `file` is the name in an Error. Throws
// nothing. The table is shallow enough to be walked and destroyed by recursion.
[[nodiscard]] Result<toml::table> parse_toml(std::string_view text, const std::string& file,
                                             const TomlLimits& limits);

// The same for a file, whose size is limited by limits.bytes.
[[nodiscard]] Result<toml::table> load_toml(const std::filesystem::path& path,
                                            const TomlLimits& limits);

}  // namespace posed
