// JSON of strangers, and JSON values as text. Strings that are not valid UTF-8 (a file's name, a
// label, a device's own name) get U+FFFD in place of the invalid bytes, because nlohmann's dump()
// would throw.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace posed {

// On one line, or indented by `indent` spaces per level. Safe for a terminal, as clean_json() says.
[[nodiscard]] std::string json_text(const nlohmann::json& value, int indent = -1);
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& value, int indent = -1);

// JSON in which every character that clean() escapes is escaped as JSON does it, as in \u202e: a
// terminal shows it, and a program reads the string that it was. `json` is valid JSON and UTF-8.
[[nodiscard]] std::string clean_json(std::string_view json);

// The value that the text describes; is_discarded() if it is no JSON, has more than kMaxJson bytes
// or is nested deeper than kMaxJsonDepth: values take up to thirty times their text, and what walks
// them needs stack for each level.
inline constexpr std::size_t kMaxJson = 1024 * 1024;
inline constexpr int kMaxJsonDepth = 32;
[[nodiscard]] nlohmann::json parse_json(std::string_view text);

}  // namespace posed
