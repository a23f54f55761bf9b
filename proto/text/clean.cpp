#include "proto/text/clean.hpp"

#include <array>
#include <cstdint>
#include <cstdio>

#include "proto/text/json_text.hpp"

namespace posed {
namespace {

constexpr std::string_view kEllipsis = "...";
constexpr std::uint32_t kNoCharacter = 0xFFFFFFFF;

struct Character {
  std::uint32_t code = kNoCharacter;  // kNoCharacter: the byte does not begin valid UTF-8
  std::size_t bytes = 1;
};

// Decodes the first character of `text`, which is not empty. Overlong forms, surrogates and codes
// beyond Unicode are invalid: terminals differ in how they treat them.
Character first_character(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xC0U) != 0x80U) return {};
    code = code << 6 | (next & 0x3FU);
  }
  constexpr std::array<std::uint32_t, 5> kMinCodePoint{0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kMinCodePoint[bytes] || code > 0x10FFFF || surrogate) return {};
  return {code, bytes};
}

// True for characters that control a terminal (C0, DEL, C1), change how the rest of a line is
// displayed (line and paragraph separators; the marks, embeddings, overrides and isolates of the
// writing direction), or are not seen, so that two names look alike (the most common of these).
bool is_control(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code <= 0x9F) || code == 0x00AD || code == 0x034F ||
         code == 0x061C || code == 0x115F || code == 0x1160 || code == 0x180E || code == 0x3164 ||
         code == 0xFFA0 || (code >= 0x200B && code <= 0x200F) ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2060 && code <= 0x206F) ||
         code == 0xFEFF || (code >= 0xFFF9 && code <= 0xFFFB) ||
         (code >= 0xE0000 && code <= 0xE0FFF);
}

std::string escaped(const char* format, unsigned value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// One character as it is displayed: itself, or escaped.
std::string shown(const Character& character, std::string_view text) {
  if (character.code == kNoCharacter) {
    return escaped("\\x%02x", static_cast<unsigned char>(text[0]));
  }
  if (!is_control(character.code)) return std::string(text.substr(0, character.bytes));
  if (character.code == '\n') return "\\n";
  if (character.code == '\r') return "\\r";
  if (character.code == '\t') return "\\t";
  return escaped(character.code < 0x80 ? "\\x%02x" : "\\u{%04x}", character.code);
}

}  // namespace

std::string clean(std::string_view text, std::size_t max_bytes) {
  std::string out;
  while (!text.empty()) {
    const Character character = first_character(text);
    const std::string next = shown(character, text);
    if (out.size() + next.size() > max_bytes) return out.append(kEllipsis);
    out += next;
    text.remove_prefix(character.bytes);
  }
  return out;
}

std::string clean_json(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  while (!json.empty()) {
    const Character character = first_character(json);
    const std::uint32_t code = character.code;
    const bool blank = code == '\n' || code == '\r' || code == '\t';  // between the values
    if (code == kNoCharacter || blank || !is_control(code)) {
      out += json.substr(0, character.bytes);
    } else if (code < 0x10000) {
      out += escaped("\\u%04x", code);
    } else {  // as the two halves of UTF-16
      out += escaped("\\u%04x", 0xD7C0 + (code >> 10));
      out += escaped("\\u%04x", 0xDC00 + (code & 0x3FF));
    }
    json.remove_prefix(character.bytes);
  }
  return out;
}

std::string clean_name(std::string_view name) { return clean(name, kMaxNameBytes); }

std::string in_quotes(std::string_view name) { return "'" + clean_name(name) + "'"; }

}  // namespace posed
