// TOML that people write or that comes from elsewhere: the only way in. Checked for size and depth
// before it is parsed, and read whole or refused with the first thing wrong in it. Cold.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include "proto/frame/result.hpp"
#include "proto/text/toml_scan.hpp"

namespace posed {

// The table of a text that keeps within `limits`; `file` is what an Error names. No exception
// leaves it, and the table is shallow enough to be walked and destroyed by recursion.
[[nodiscard]] Result<toml::table> parse_toml(std::string_view text, const std::string& file,
                                             const TomlLimits& limits);

// The same of a file, which is bounded by limits.bytes.
[[nodiscard]] Result<toml::table> load_toml(const std::filesystem::path& path,
                                            const TomlLimits& limits);

// What a reader of such a table derives from: it remembers the first mistake, with its line.
class FirstError {
 public:
  explicit FirstError(std::string file) : file_(std::move(file)) {}

  void add_error(const toml::node& node, std::string_view message);
  [[nodiscard]] const std::optional<Error>& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  std::string file_;
  std::optional<Error> error_;
};

}  // namespace posed
