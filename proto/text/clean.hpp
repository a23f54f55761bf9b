// Text that somebody else wrote (a file, a message, a device, a log) made fit for a terminal, a log
// line and an error's sentence. Everything foreign that a person will read goes through here. Cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace posed {

inline constexpr std::size_t kMaxNameBytes = 60;    // of a name inside a sentence or a table
inline constexpr std::size_t kMaxLineBytes = 2000;  // of a whole sentence

// `text` with every control character (line ends and tabs included), invisible direction mark and
// byte that is not UTF-8 written out, as in \x1b, \u{202e} and \xff, so that a terminal shows it
// instead of obeying it. At most `max_bytes` of the result are kept, cut between two characters;
// "..." behind them says that something is missing. Costs O(max_bytes), however long the text is.
[[nodiscard]] std::string clean(std::string_view text, std::size_t max_bytes = kMaxLineBytes);

// The same with the length of a name: for a table's cell, or inside other quotes.
[[nodiscard]] std::string clean_name(std::string_view name);

// How a sentence names a thing of somebody's: 'index_mcp'.
[[nodiscard]] std::string in_quotes(std::string_view name);

}  // namespace posed
