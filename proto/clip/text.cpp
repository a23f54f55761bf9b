#include "proto/clip/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

namespace posed::clip {
namespace {

// from_chars returns no value for a number outside double's range; one too small counts as zero.
bool underflows(std::string_view word) noexcept {
  const std::size_t exponent = word.find_first_of("eE");
  return exponent != std::string_view::npos && exponent + 1 < word.size() &&
         word[exponent + 1] == '-';
}

}  // namespace

std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::optional<double> parse_number(std::string_view word, double max) noexcept {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range && underflows(word)) return 0.0;
  if (error != std::errc() || !std::isfinite(value) || std::abs(value) > max) {
    return std::nullopt;
  }
  return value;
}

std::string_view trim(std::string_view text) noexcept {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view next_word(std::string_view& text) noexcept {
  std::size_t begin = 0;
  while (begin < text.size() && is_space(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_space(text[end])) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

std::string_view next_line(std::string_view& text) noexcept {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end);
  if (text.starts_with("\r\n")) {
    text.remove_prefix(2);
  } else if (!text.empty()) {
    text.remove_prefix(1);
  }
  return line;
}

void Cursor::skip_space() {
  while (!text_.empty() && is_space(text_.front())) {
    const bool ends_line =
        text_.front() == '\n' || (text_.front() == '\r' && !text_.starts_with("\r\n"));
    if (ends_line) ++next_line_;
    text_.remove_prefix(1);
  }
}

std::string_view Cursor::peek() {
  skip_space();
  std::string_view rest = text_;
  const std::string_view word = next_word(rest);
  const std::size_t brace = word.find_first_of("{}");
  return word.substr(0, brace == 0 ? 1 : brace);
}

std::string_view Cursor::word() {
  const std::string_view word = peek();
  line_ = next_line_;
  text_.remove_prefix(word.size());
  return word;
}

std::string_view Cursor::name() {
  line_ = next_line_;
  const std::string_view name = text_.substr(0, text_.find_first_of("{}\r\n"));
  text_.remove_prefix(name.size());
  return trim(name);
}

std::string_view Cursor::rest() {
  line_ = next_line_;
  const bool last = text_.find_first_of("\r\n") == std::string_view::npos;
  const std::string_view line = next_line(text_);
  if (!last) ++next_line_;
  return trim(line);
}

bool has_line(std::string_view text, std::string_view start) noexcept {
  while (!text.empty()) {
    const std::string_view line = next_line(text);
    if (trim(line).starts_with(start)) return true;
  }
  return false;
}

std::string_view without_bom(std::string_view text) noexcept {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

std::string utf8_of(std::string text) {
  const bool big = text.starts_with("\xfe\xff");
  if (!big && !text.starts_with("\xff\xfe")) return text;
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(text[i]);
    const auto second = static_cast<unsigned char>(text[i + 1]);
    return static_cast<std::uint32_t>(big ? first << 8 | second : second << 8 | first);
  };
  std::string out;
  for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
    std::uint32_t code = unit(i);
    const std::uint32_t next = i + 3 < text.size() ? unit(i + 2) : 0;
    const bool pair = code >= 0xd800 && code < 0xdc00 && next >= 0xdc00 && next < 0xe000;
    if (pair) {
      code = 0x10000 + ((code - 0xd800) << 10) + (next - 0xdc00);
      i += 2;
    } else if (code >= 0xd800 && code < 0xe000) {
      code = 0xfffd;
    }
    const auto add = [&out](std::uint32_t byte) { out += static_cast<char>(byte); };
    if (code < 0x80) {
      add(code);
      continue;
    }
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;  // bytes behind the first
    constexpr std::array<std::uint32_t, 4> kFirst{0, 0xc0, 0xe0, 0xf0};
    add(kFirst[static_cast<std::size_t>(more)] | code >> 6 * more);
    for (int k = more - 1; k >= 0; --k) add(0x80 | (code >> 6 * k & 0x3f));
  }
  return out;
}

}  // namespace posed::clip
