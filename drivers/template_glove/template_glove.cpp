// The template glove: an invented glove that writes a line of text a measurement. It is a whole
// driver; copy its folder to begin one for a glove of this kind (drivers/README.md shows how).
//
// The glove sends a line over its serial port (115200 baud) a hundred times a second:
//
//   G 1023 512 0 87 1001 B 1 *5C
//
//   G      five bends, thumb to little finger: 0 (straight) to 1023 (closed)
//   B      the button: 1 pressed, 0 not
//   *      exclusive or of all bytes before the '*', two hexadecimal digits
#include <array>
#include <charconv>
#include <cstdio>

#include "drivers/glove/text_glove.hpp"

namespace posed::drivers {
namespace template_glove {
namespace {

// Removes the next number and its blank from the front of `text`; -1 if there is none.
RT_SAFE int next_number(std::string_view& text, int base = 10) noexcept {
  int number = -1;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  const std::size_t used = stop - text.data();
  text.remove_prefix(used < text.size() && text[used] == ' ' ? used + 1 : used);
  return error == std::errc() && number >= 0 ? number : -1;
}

// Removes this word from the front of `text`, if `text` begins with it.
RT_SAFE bool next_word(std::string_view& text, std::string_view word) noexcept {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

RT_SAFE int checksum_of(std::string_view text) noexcept {
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  return static_cast<int>(sum);
}

struct TemplateGlove : glove::TextGlove<TemplateGlove> {
  using Reading = glove::TextReading<TemplateGlove>;
  static constexpr std::string_view kName = "template_glove";
  static constexpr std::string_view kSummary =
      "an invented glove that writes text; copy its folder to begin a driver";
  static constexpr std::int64_t kBaud = 115200;
  static constexpr double kRate_hz = 100.0;
  static constexpr double kRawMax = 1023.0;
  static constexpr std::array<std::string_view, 5> kSensors = kFingerNames;
  static constexpr std::array<std::string_view, 1> kExtras{"button"};
  static constexpr double kUndetected = 0.005;  // 8 bits miss one in 256 of two faults in a line

  // kForeign for what is no such line, kBadChecksum, kOutOfRange.
  RT_SAFE static Outcome parse(std::string_view text, Reading& reading) noexcept {
    const std::size_t star = text.find('*');
    if (star == std::string_view::npos) return Outcome::kForeign;
    std::string_view sum = text.substr(star + 1);
    if (sum.size() != 2) return Outcome::kForeign;
    if (next_number(sum, 16) != checksum_of(text.substr(0, star))) return Outcome::kBadChecksum;
    text = text.substr(0, star);
    if (!next_word(text, "G ")) return Outcome::kForeign;
    for (std::size_t s = 0; s < kSensors.size(); ++s) {
      const int bend = next_number(text);
      if (bend < 0) return Outcome::kForeign;
      if (bend > kRawMax) return Outcome::kOutOfRange;
      reading.raw[s] = static_cast<float>(bend);
      reading.valid[s] = true;
    }
    if (!next_word(text, "B ")) return Outcome::kForeign;
    reading.extra[0] = next_number(text) == 1 ? 1.0F : 0.0F;
    return text.empty() ? Outcome::kOk : Outcome::kForeign;
  }

  static std::string write(const Reading& reading) {
    std::string line = "G ";
    for (const float bend : reading.raw) line += std::to_string(static_cast<int>(bend)) + ' ';
    line += reading.extra[0] > 0.0F ? "B 1 " : "B 0 ";
    std::array<char, 8> sum{};
    (void)std::snprintf(sum.data(), sum.size(), "*%02X\n", checksum_of(line));
    return line + sum.data();
  }
};

}  // namespace
}  // namespace template_glove

const Driver& template_glove_driver() { return DriverOf<template_glove::TemplateGlove>::get(); }

}  // namespace posed::drivers
