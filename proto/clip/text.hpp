// Reading text that people and many programs wrote: words with their line numbers, and numbers that
// do not depend on the locale.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::clip {

// A finite number of plausible size, written plain or with an exponent; a leading '+' is allowed,
// one too small for a double is 0. RT-safe.
[[nodiscard]] std::optional<double> parse_number(std::string_view word) noexcept;

// The shortest text that is read back as the same number.
[[nodiscard]] std::string number_text(double value);

// The number of a joint angle or length: |value| at most 1e9. RT-safe.
inline constexpr double kMaxValue = 1e9;

[[nodiscard]] constexpr bool is_space(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}
[[nodiscard]] std::string_view trim(std::string_view text) noexcept;
[[nodiscard]] std::string lower(std::string_view text);

// The word at the start of `text`, which then begins after it; empty at the end. RT-safe.
[[nodiscard]] std::string_view next_word(std::string_view& text) noexcept;

// The line at the start of `text` without its end (\n, \r\n or a bare \r); `text` then begins after
// it. RT-safe.
[[nodiscard]] std::string_view next_line(std::string_view& text) noexcept;

// Walks a text word by word and knows the line it is on. Braces are words of their own.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text), all_(text) {}

  [[nodiscard]] std::string_view word();            // next word, over line ends; empty at the end
  [[nodiscard]] std::string_view peek();            // the same without taking it
  [[nodiscard]] std::string_view rest();            // rest of this line, trimmed; takes its end too
  [[nodiscard]] std::string_view name();            // rest of this line up to a brace, trimmed
  [[nodiscard]] int line() const { return line_; }  // of what was taken last, from 1
  [[nodiscard]] std::size_t offset() const { return all_.size() - text_.size(); }

 private:
  void skip_space();

  std::string_view text_;
  std::string_view all_;
  int next_line_ = 1;
  int line_ = 1;
};

// Writes a file beside the target first: a full disk leaves no half-written clip behind under its
// name.
[[nodiscard]] Result<> write_text(const std::filesystem::path& path,
                                  const std::function<void(std::ostream&)>& write);

// `text` without a UTF-8 byte order mark.
[[nodiscard]] std::string_view without_bom(std::string_view text) noexcept;

}  // namespace posed::clip
