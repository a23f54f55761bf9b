// Makes untrusted text (from a file, a message, a device or a log) safe for a terminal, a log line
// and an error message. All untrusted text that a person will read passes through here. Cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace posed {

inline constexpr std::size_t kMaxNameBytes = 60;    // length of a name in a sentence or a table
inline constexpr std::size_t kMaxLineBytes = 2000;  // length of a whole sentence

// Returns `text` with every control character (including line ends and tabs), invisible direction
// mark and byte that is not UTF-8 escaped, as in \x1b, \u{202e} and \xff, so that a terminal shows
// it instead of obeying it. At most `max_bytes` of the result are kept, cut between two characters;
// a following "..." marks the cut. Costs O(max_bytes), however long the text is.
[[nodiscard]] std::string clean(std::string_view text, std::size_t max_bytes = kMaxLineBytes);

// As clean(), limited to kMaxNameBytes: for a table's cell, or inside other quotes.
[[nodiscard]] std::string clean_name(std::string_view name);

// A name from untrusted text as error messages show it: 'index_mcp'.
[[nodiscard]] std::string in_quotes(std::string_view name);

}  // namespace posed
