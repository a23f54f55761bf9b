// TOML that people write, read whole or told of by the first thing wrong in it. Cold. Messages are
// fit for a terminal: a text may come from a log or a file that a stranger sent.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include "proto/frame/result.hpp"

namespace posed {

// The table of a text; `file` is what an Error names. No exception leaves it.
[[nodiscard]] Result<toml::table> parse_toml(std::string_view text, const std::string& file);

// What a reader of such a table derives from: it remembers the first mistake, with its line.
class FirstMistake {
 public:
  explicit FirstMistake(std::string file) : file_(std::move(file)) {}

  void blame(const toml::node& node, std::string message);
  [[nodiscard]] const std::optional<Error>& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  std::string file_;
  std::optional<Error> error_;
};

}  // namespace posed
