#include "proto/frame/toml_text.hpp"

#include <algorithm>

namespace posed {
namespace {

// Without what a terminal would obey.
std::string printable(std::string text) {
  std::ranges::replace_if(text, [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
  return text;
}

int line_of(const toml::source_region& source) { return static_cast<int>(source.begin.line); }

}  // namespace

Result<toml::table> parse_toml(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    return fail(printable(std::string(error.description())), file, line_of(error.source()));
  }
}

void FirstMistake::blame(const toml::node& node, std::string message) {
  if (!error_) error_ = Error{printable(std::move(message)), file_, line_of(node.source())};
}

}  // namespace posed
