// Tools to read text that users and other programs wrote: words with their line numbers, and
// numbers independent of the locale.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "proto/frame/rt_safe.hpp"

namespace posed::clip {

// Largest |value| of a joint angle or length, and of a time: loggers write Unix seconds.
inline constexpr double kMaxValue = 1e9;
inline constexpr double kMaxTime_s = 1e11;

// Parses a finite number of at most `max` in size, with or without an exponent. A leading '+' is
// allowed; a number too small for a double becomes 0.
RT_SAFE [[nodiscard]] std::optional<double> parse_number(std::string_view word,
                                                         double max = kMaxValue) noexcept;

// The shortest text that reads back as the same number.
[[nodiscard]] std::string number_text(double value);

RT_SAFE [[nodiscard]] constexpr bool is_space(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}
[[nodiscard]] std::string_view trim(std::string_view text) noexcept;

// Removes the first word from `text` and returns it; empty at the end.
RT_SAFE [[nodiscard]] std::string_view next_word(std::string_view& text) noexcept;

// Removes the first line from `text` and returns it without its end (\n, \r\n or a bare \r).
RT_SAFE [[nodiscard]] std::string_view next_line(std::string_view& text) noexcept;

// Returns whether a line of `text` begins with `start`, after blanks.
[[nodiscard]] bool has_line(std::string_view text, std::string_view start) noexcept;

// Walks through a text word by word and tracks the line number. Braces are words of their own.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text), all_(text) {}

  [[nodiscard]] std::string_view word();  // next word, across line ends; empty at the end
  [[nodiscard]] std::string_view peek();  // like word(), but the word stays
  [[nodiscard]] std::string_view rest();  // rest of this line, trimmed; also skips the line end
  [[nodiscard]] std::string_view name();  // rest of this line up to a brace, trimmed
  [[nodiscard]] int line() const { return line_; }  // line of the last word returned, from 1
  [[nodiscard]] std::size_t offset() const { return all_.size() - text_.size(); }

 private:
  void skip_space();

  std::string_view text_;
  std::string_view all_;
  int next_line_ = 1;
  int line_ = 1;
};

// `text` without a UTF-8 byte order mark.
[[nodiscard]] std::string_view without_bom(std::string_view text) noexcept;

// `text` as UTF-8 if it begins with a byte order mark of UTF-16, as Windows' "Unicode" does,
// otherwise as it is. Half a pair becomes U+FFFD.
[[nodiscard]] std::string utf8_of(std::string text);

}  // namespace posed::clip
