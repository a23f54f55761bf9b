#include "drivers/p5/device_info.hpp"

#include <array>
#include <charconv>

#include "drivers/glove/device_info.hpp"

namespace posed::drivers::p5 {
namespace {

constexpr std::string_view kNone = "none";

std::string hex_of(const std::vector<std::byte>& bytes) {
  if (bytes.empty()) return std::string(kNone);
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{0xF})];
  }
  return text;
}

// Returns false when the text is not this report, complete.
bool read_hex(const std::string& text, std::uint8_t number, std::size_t size,
              std::vector<std::byte>& bytes) {
  if (text == kNone) return true;
  if (text.size() != 2 * size) return false;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    unsigned value = 0;
    const char* const end = text.data() + i + 2;
    const auto [stop, error] = std::from_chars(text.data() + i, end, value, 16);
    if (error != std::errc() || stop != end) return false;
    bytes.push_back(static_cast<std::byte>(value));
  }
  return bytes[0] == std::byte{number};
}

}  // namespace

std::optional<CameraRig> GloveSettings::rig() const {
  if (heads.size() != kHeadsBytes || leds.size() != kLedsBytes) return {};
  return CameraRig::of(std::span(heads).first<kHeadsBytes>(), std::span(leds).first<kLedsBytes>());
}

std::string device_info_of(const GloveSettings& glove) {
  return "p5 hand=" + std::string(glove::side_name(glove.side)) +
         " firmware=" + hex_of(glove.firmware) + " heads=" + hex_of(glove.heads) +
         " leds=" + hex_of(glove.leds);
}

Result<GloveSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, "p5", identity);
  GloveSettings glove;
  glove.side = reader.side();
  const std::string firmware = reader.word("firmware");
  const std::string heads = reader.word("heads");
  const std::string leds = reader.word("leds");
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  if (!read_hex(firmware, kFirmwareReport, kFirmwareBytes, glove.firmware) ||
      !read_hex(heads, kHeadsReport, kHeadsBytes, glove.heads) ||
      !read_hex(leds, kLedsReport, kLedsBytes, glove.leds)) {
    return fail("the device info of a 'p5' has an invalid feature report; the log is damaged",
                identity);
  }
  return glove;
}

}  // namespace posed::drivers::p5
