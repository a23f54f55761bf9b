#include "drivers/axis/protocol.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "drivers/byte_reader.hpp"
#include "drivers/decimals.hpp"
#include "drivers/packer.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/number.hpp"

namespace posed::drivers::axis {
namespace {

constexpr std::uint16_t kStart = 0xDDFF;
constexpr std::uint16_t kEnd = 0xEEFF;
constexpr std::size_t kEndAt = 62;
constexpr double kMaxPosition_cm = 100.0 * kMaxPosition_m;
constexpr double kMaxAngle_deg = kMaxAngle_rad / kDegree;
constexpr int kDecimals = 6;
constexpr std::array<Content, 4> kContents{
    {{false, false}, {false, true}, {true, false}, {true, true}}};

struct Header {
  Avatar avatar;
  Content content;
  std::size_t count = 0;
  std::uint32_t frame_number = 0;
};

RT_SAFE bool flag(std::uint32_t value, bool& set) noexcept {
  set = value == 1;
  return value <= 1;
}

RT_SAFE Outcome read_header(std::span<const std::byte> bytes, Header& header) noexcept {
  if (bytes.size() < kHeaderBytes) return Outcome::kShort;
  ByteReader end(bytes.subspan(kEndAt, 2));
  ByteReader reader(bytes);
  if (reader.u16() != kStart || end.u16() != kEnd) return Outcome::kForeign;
  (void)reader.u16();  // build and revision
  const int minor = reader.u8();
  const int major = reader.u8();
  const bool old = major == 1 && minor == 0;
  header.count = old ? reader.u32() : reader.u16();
  const bool displacement = flag(old ? reader.u32() : reader.u8(), header.content.displacement);
  const bool reference = flag(old ? reader.u32() : reader.u8(), header.content.reference);
  const std::uint32_t number = reader.u32();
  header.avatar = make_avatar(number, reader.text(kNameBytes));
  header.frame_number = old ? 0 : reader.u32();
  const bool valid = displacement && reference && major >= 1 && number <= kMaxAvatar &&
                     header.count == value_count(header.content);
  return valid ? Outcome::kOk : Outcome::kOutOfRange;
}

// Whether a pose can have these values.
RT_SAFE bool plausible(Content content, std::span<const double> values) noexcept {
  const std::size_t group = content.displacement ? 6 : 3;
  const std::size_t first = content.reference ? 6 : 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    // The reference and the hips have positions always.
    const bool position = i < first + 6 ? i % 6 < 3 : group == 6 && (i - first) % 6 < 3;
    if (!(std::abs(values[i]) <= (position ? kMaxPosition_cm : kMaxAngle_deg))) return false;
  }
  return true;
}

// Fills `values` with the numbers of the text; false when a word is none.
RT_SAFE bool read_numbers(std::string_view text, std::span<double> values) noexcept {
  for (double& value : values) {
    const auto number = clip::parse_number(clip::next_word(text));
    if (!number) return false;
    value = *number;
  }
  return true;
}

RT_SAFE std::size_t count_words(std::string_view text) noexcept {
  std::size_t words = 0;
  while (!clip::next_word(text).empty()) ++words;
  return words;
}

// Removes `words` words, which are at most one name, from `text`; empty when they are too long or
// look like values.
RT_SAFE std::string_view next_name(std::string_view& text, std::size_t words) noexcept {
  const std::string_view begin = text = clip::trim(text);
  bool named = words == 1;
  for (std::size_t i = 0; i < words; ++i) {
    const std::string_view word = clip::next_word(text);
    named = named || !clip::parse_number(word);
  }
  const std::string_view name = begin.substr(0, begin.size() - text.size());
  return named && name.size() <= kNameBytes ? name : std::string_view();
}

RT_SAFE std::optional<Content> content_of(std::size_t count) noexcept {
  const auto* const at = std::ranges::find(kContents, count, value_count);
  return at == kContents.end() ? std::nullopt : std::optional(*at);
}

// Reads name and values; `words` is how many words the text has.
RT_SAFE Outcome read_text(std::string_view text, std::size_t words, Message& message) noexcept {
  std::size_t name_words = 1;
  auto content = content_of(words - name_words);
  while (!content && name_words < kNameBytes && name_words < words) {
    content = content_of(words - ++name_words);
  }
  if (!content) return Outcome::kShort;
  const std::string_view name = next_name(text, name_words);
  if (name.empty()) return Outcome::kShort;
  message.avatar = make_avatar(message.avatar.number, name);
  message.content = *content;
  const std::span values(message.values.data(), value_count(*content));
  return read_numbers(text, values) && plausible(*content, values) ? Outcome::kOk
                                                                   : Outcome::kOutOfRange;
}

// Writes a value as std::to_chars does, with kDecimals; null where there is no room. A number that
// is small, as all of a pose are, and lies clearly on one side of the half is rounded here.
RT_SAFE char* put_value(char* at, char* end, double value) noexcept {
  constexpr std::ptrdiff_t kMaxLength = 16;  // "-999999.999999"
  constexpr double kClear = 1e-3;            // the product is off by a tenth of this
  const double parts = std::abs(value) * 1e6;
  if (end - at >= kMaxLength && parts < 1e12) {
    const auto whole = static_cast<std::int64_t>(parts);
    const double rest = parts - static_cast<double>(whole);
    if (std::abs(rest - 0.5) > kClear) {
      *at = '-';
      at += std::signbit(value) ? 1 : 0;
      return put_decimals<kDecimals>(at, whole + (rest > 0.5 ? 1 : 0));
    }
  }
  const auto put = std::to_chars(at, end, value, std::chars_format::fixed, kDecimals);
  return put.ec == std::errc() ? put.ptr : nullptr;
}

RT_SAFE bool fits_a_name(char c) noexcept {
  const auto code = static_cast<unsigned char>(c);
  return code > 0x20 && code != 0x7F && code != 0xFF && c != '|';
}

}  // namespace

RT_SAFE std::string_view Avatar::name_text() const noexcept {
  const auto* const end = std::ranges::find(name, '\0');
  return {name.data(), static_cast<std::size_t>(end - name.begin())};
}

RT_SAFE Avatar make_avatar(std::uint32_t number, std::string_view name) noexcept {
  Avatar avatar{.number = number, .name = {}};
  name = name.substr(0, std::min({name.find('\0'), name.size(), kNameBytes}));
  std::ranges::copy(name, avatar.name.begin());
  return avatar;
}

RT_SAFE Outcome measure_binary(std::span<const std::byte> header, std::size_t& size) noexcept {
  Header read;
  const Outcome outcome = read_header(header, read);
  size = kHeaderBytes + 4 * read.count;
  return outcome;
}

RT_SAFE Outcome decode_binary(std::span<const std::byte> bytes, Message& message) noexcept {
  Header header;
  if (const Outcome outcome = read_header(bytes, header); outcome != Outcome::kOk) return outcome;
  if (bytes.size() != kHeaderBytes + 4 * header.count) return Outcome::kShort;
  message.avatar = header.avatar;
  message.content = header.content;
  message.frame_number = header.frame_number;
  ByteReader reader(bytes.subspan(kHeaderBytes));
  const std::span values(message.values.data(), header.count);
  for (double& value : values) value = static_cast<double>(reader.f32());
  return plausible(header.content, values) ? Outcome::kOk : Outcome::kOutOfRange;
}

RT_SAFE Outcome decode_text(std::string_view text, Message& message) noexcept {
  message.frame_number = 0;
  const std::string_view number = clip::next_word(text);
  const std::size_t words = count_words(text);
  if (words == 0) return Outcome::kShort;
  const auto avatar = exact_number<std::uint32_t>(number);
  const bool known = avatar && *avatar <= kMaxAvatar;
  if (avatar) message.avatar.number = *avatar;
  const Outcome outcome = read_text(text, words, message);
  return outcome == Outcome::kOk && !known ? Outcome::kOutOfRange : outcome;
}

RT_SAFE std::size_t encode_binary(const Message& message, Form form,
                                  std::span<std::byte> out) noexcept {
  const std::size_t count = value_count(message.content);
  const std::size_t size = kHeaderBytes + 4 * count;
  if (out.size() < size) return 0;
  const bool old = form == Form::kOldBinary;
  Packer packer(out);
  packer.number(kStart, 2);
  packer.number(old ? 0x01000000 : 0x01010000, 4);
  packer.number(count, old ? 4 : 2);
  packer.number(message.content.displacement ? 1 : 0, old ? 4 : 1);
  packer.number(message.content.reference ? 1 : 0, old ? 4 : 1);
  packer.number(message.avatar.number, 4);
  packer.text(message.avatar.name);
  packer.number(old ? 0 : message.frame_number, 4);
  for (int reserved = old ? 1 : 3; reserved > 0; --reserved) packer.number(0, 4);
  packer.number(kEnd, 2);
  for (std::size_t i = 0; i < count; ++i) {
    packer.f32(static_cast<float>(message.values[i]));
  }
  return size;
}

RT_SAFE std::size_t encode_text(const Message& message, std::span<char> out,
                                std::span<ShortText> known) noexcept {
  char* at = out.data();
  char* const end = at + out.size();
  const auto put = [&](char c) {
    if (at != end) *at++ = c;
  };
  const auto number = std::to_chars(at, end, message.avatar.number);
  if (number.ec != std::errc()) return 0;
  at = number.ptr;
  put(' ');
  const std::string_view name = message.avatar.name_text();
  for (const char c : name.empty() ? std::string_view("_") : name) put(fits_a_name(c) ? c : '_');
  for (std::size_t group = 0; group < value_count(message.content) / 3; ++group) {
    ShortText* const text = group < known.size() ? &known[group] : nullptr;
    if (text != nullptr && text->size > 0 && end - at >= std::ssize(text->text)) {
      std::memcpy(at, text->text.data(), text->text.size());  // of a length that is known
      at += text->size;
      continue;
    }
    const char* const begin = at;
    for (std::size_t i = 3 * group; i < 3 * group + 3; ++i) {
      put(' ');
      at = put_value(at, end, message.values[i]);
      if (at == nullptr) return 0;
    }
    if (text == nullptr || at - begin > std::ssize(text->text)) continue;
    text->size = static_cast<std::uint8_t>(at - begin);
    std::memcpy(text->text.data(), begin, text->size);
  }
  if (end - at < 3) return 0;
  for (const char c : {' ', kTextEnd[0], kTextEnd[1]}) put(c);
  return at - out.data();
}

}  // namespace posed::drivers::axis
