#include "drivers/json_reader.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

namespace posed::drivers {
namespace {

constexpr double kNotFinite = std::numeric_limits<double>::quiet_NaN();

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

bool is_not_finite(std::string_view word) noexcept {
  return word == "NaN" || word == "Infinity" || word == "-Infinity";
}

// The four hexadecimal digits at the beginning of `text`; false when there are none.
RT_SAFE bool hex4(std::string_view text, std::uint32_t& code) noexcept {
  constexpr std::string_view kDigits = "0123456789abcdef0123456789ABCDEF";
  if (text.size() < 4) return false;
  code = 0;
  for (const char c : text.substr(0, 4)) {
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) return false;
    code = code << 4 | static_cast<std::uint32_t>(digit % 16);
  }
  return true;
}

// The character of \uXXXX, or of two of them, at the beginning of `raw`, and the number of bytes
// that it takes there; 0 when it is none.
RT_SAFE std::size_t escaped_code(std::string_view raw, std::uint32_t& code) noexcept {
  if (!raw.starts_with("\\u") || !hex4(raw.substr(2), code)) return 0;
  if (code < 0xD800 || code > 0xDFFF) return 6;
  std::uint32_t low = 0;
  const bool pair = code <= 0xDBFF && raw.substr(6).starts_with("\\u") && hex4(raw.substr(8), low);
  if (!pair || low < 0xDC00 || low > 0xDFFF) return 0;
  code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
  return 12;
}

struct Utf8 {
  std::array<char, 4> bytes{};
  std::size_t size = 0;
};

Utf8 utf8_of(std::uint32_t code) noexcept {
  const auto tail = [code](int shift) {
    return static_cast<char>(0x80U | (code >> static_cast<unsigned>(shift) & 0x3FU));
  };
  if (code < 0x80) return {{static_cast<char>(code)}, 1};
  if (code < 0x800) return {{static_cast<char>(0xC0U | code >> 6U), tail(0)}, 2};
  if (code < 0x10000) return {{static_cast<char>(0xE0U | code >> 12U), tail(6), tail(0)}, 3};
  return {{static_cast<char>(0xF0U | code >> 18U), tail(12), tail(6), tail(0)}, 4};
}

// The letter after a backslash; 0 when it is no escape.
char simple_escape(char letter) noexcept {
  constexpr std::string_view kLetters = "\"\\/bfnrt";
  constexpr std::string_view kMeant = "\"\\/\b\f\n\r\t";
  const std::size_t at = kLetters.find(letter);
  return at == std::string_view::npos ? '\0' : kMeant[at];
}

}  // namespace

RT_SAFE bool JsonReader::fail(Fault fault) noexcept {
  if (fault_ == Fault::kNone) fault_ = fault;
  at_ = end_;
  return false;
}

// The first character of what comes next.
RT_SAFE bool JsonReader::peek(char& first) noexcept {
  while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  if (at_ == end_) return fail(Fault::kCut);
  first = *at_;
  return true;
}

// False at the end of the object or list, which is left.
RT_SAFE bool JsonReader::separate(char close) noexcept {
  char c = 0;
  if (!ok() || !peek(c)) return false;
  if (c == close) {
    ++at_;
    --depth_;
    first_ = false;
    return false;
  }
  if (first_) {
    first_ = false;
    return true;
  }
  if (c != ',') return fail(Fault::kWrong);
  ++at_;
  return true;
}

RT_SAFE bool JsonReader::next(std::string_view& key) noexcept {
  char c = 0;
  if (!separate('}') || !peek(c)) return false;
  if (c != '"') return fail(Fault::kWrong);
  if (!quoted(key) || !peek(c)) return false;
  if (c != ':') return fail(Fault::kWrong);
  ++at_;
  return true;
}

RT_SAFE bool JsonReader::next() noexcept { return separate(']'); }

RT_SAFE bool JsonReader::enter(char open, bool object) noexcept {
  char c = 0;
  if (!ok() || !peek(c)) return false;
  if (c != open) {
    skip();
    return false;
  }
  if (depth_ == kMaxDepth) return fail(Fault::kDeep);
  ++at_;
  ++depth_;
  const std::uint64_t bit = std::uint64_t{1} << depth_;
  objects_ = object ? objects_ | bit : objects_ & ~bit;
  first_ = true;
  return true;
}

RT_SAFE bool JsonReader::quoted(std::string_view& value) noexcept {
  const char* const begin = ++at_;
  while (at_ != end_ && *at_ != '"') {
    if (static_cast<unsigned char>(*at_) < 0x20) return fail(Fault::kWrong);
    at_ += *at_ == '\\' && at_ + 1 != end_ ? 2 : 1;
  }
  if (at_ == end_) return fail(Fault::kCut);
  value = {begin, static_cast<std::size_t>(at_ - begin)};
  ++at_;
  return true;
}

RT_SAFE bool JsonReader::word(std::string_view expected) noexcept {
  const std::string_view left(at_, static_cast<std::size_t>(end_ - at_));
  if (left.starts_with(expected)) {
    at_ += expected.size();
    return true;
  }
  return fail(expected.starts_with(left) ? Fault::kCut : Fault::kWrong);
}

RT_SAFE bool JsonReader::number(double& value) noexcept {
  char c = 0;
  if (!ok() || !peek(c)) return false;
  if (c == '"') {
    std::string_view text;
    value = kNotFinite;
    return quoted(text) && is_not_finite(text);
  }
  const char* const digits = at_ + (c == '-' ? 1 : 0);
  if (digits == end_) return fail(Fault::kCut);
  value = kNotFinite;
  if (c == 'N') return word("NaN");
  if (*digits == 'I') {
    at_ = digits;
    return word("Infinity");
  }
  if (!is_digit(*digits)) {
    skip();
    return false;
  }
  const auto [stop, error] = std::from_chars(at_, end_, value);
  if (error != std::errc()) value = kNotFinite;
  at_ = stop;
  return true;
}

RT_SAFE bool JsonReader::boolean(bool& value) noexcept {
  char c = 0;
  if (!ok() || !peek(c)) return false;
  if (c != 't' && c != 'f') {
    skip();
    return false;
  }
  value = c == 't';
  return word(value ? "true" : "false");
}

RT_SAFE bool JsonReader::text(std::string_view& value) noexcept {
  char c = 0;
  if (!ok() || !peek(c)) return false;
  if (c == '"') return quoted(value);
  skip();
  return false;
}

RT_SAFE void JsonReader::skip_any() noexcept {
  char c = 0;
  if (!peek(c)) return;
  std::string_view ignored_text;
  double ignored = 0.0;
  switch (c) {
    case '{':
      static_cast<void>(enter_object());
      break;
    case '[':
      static_cast<void>(enter_array());
      break;
    case '"':
      static_cast<void>(quoted(ignored_text));
      break;
    case 't':
      static_cast<void>(word("true"));
      break;
    case 'f':
      static_cast<void>(word("false"));
      break;
    case 'n':
      static_cast<void>(word("null"));
      break;
    default: {
      const bool cut = c == '-' && at_ + 1 == end_;
      const char digit = c == '-' && !cut ? at_[1] : c;
      if (cut || c == 'N' || digit == 'I' || is_digit(digit)) {
        static_cast<void>(number(ignored));
      } else {
        static_cast<void>(fail(Fault::kWrong));
      }
    }
  }
}

RT_SAFE void JsonReader::skip() noexcept {
  const int outside = depth_;
  skip_any();
  while (ok() && depth_ > outside) {
    std::string_view key;
    const bool in_object = (objects_ >> depth_ & 1U) != 0;
    if (in_object ? next(key) : next()) skip_any();
  }
}

RT_SAFE bool JsonReader::at_end() noexcept {
  while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  return at_ == end_;
}

RT_SAFE std::size_t unescape_json(std::string_view raw, std::span<char> room) noexcept {
  std::size_t used = 0;
  while (!raw.empty()) {
    Utf8 one{{raw[0]}, 1};
    std::size_t taken = 1;
    std::uint32_t code = 0;
    if (raw[0] == '\\' && raw.size() > 1 && simple_escape(raw[1]) != '\0') {
      one.bytes[0] = simple_escape(raw[1]);
      taken = 2;
    } else if (const std::size_t length = escaped_code(raw, code); length != 0) {
      one = utf8_of(code);
      taken = length;
    }
    if (used + one.size > room.size()) break;
    std::copy_n(one.bytes.data(), one.size, room.data() + used);
    used += one.size;
    raw.remove_prefix(taken);
  }
  // Bytes of a character that did not fit are no text.
  if (raw.empty()) return used;
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  if (continues(raw[0])) {
    while (used > 0 && continues(room[used - 1])) --used;
    if (used > 0) --used;
  }
  return used;
}

}  // namespace posed::drivers
