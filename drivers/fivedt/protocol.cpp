#include "drivers/fivedt/protocol.hpp"

#include <algorithm>

namespace posed::drivers::fivedt {
namespace {

constexpr std::byte kFiveStart{0x80};
constexpr std::byte kWideStart{'<'};
constexpr std::size_t kFiveBytes = 9;
constexpr std::size_t kWideInfoBytes = 7;
constexpr std::size_t kSixteenBytes = 36;
constexpr std::size_t kUltraBytes = 29;
constexpr std::size_t kUltraAt = 3;  // first byte of the packed values
constexpr std::size_t kUltraValues = 14;
constexpr std::size_t kUsbBytes = 64;
constexpr unsigned kMaxValue = 0xFFF;

unsigned number(std::byte byte) noexcept { return std::to_integer<unsigned>(byte); }

std::byte xor_of(std::span<const std::byte> bytes) noexcept {
  std::byte sum{0};
  for (const std::byte byte : bytes) sum ^= byte;
  return sum;
}

Outcome decode_five(std::span<const std::byte> bytes, Reading& reading) noexcept {
  if (xor_of(bytes.subspan(1, 7)) != bytes[8]) return Outcome::kBadChecksum;
  for (std::size_t i = 0; i < kFingers; ++i) {
    reading.value[i] = static_cast<std::uint16_t>(number(bytes[1 + i]));
  }
  reading.pitch = std::to_integer<std::uint8_t>(bytes[6]);
  reading.roll = std::to_integer<std::uint8_t>(bytes[7]);
  return Outcome::kOk;
}

// Sixteen values as big-endian words.
Outcome decode_words(std::span<const std::byte> bytes, Reading& reading) noexcept {
  for (std::size_t i = 0; i < kMaxValues; ++i) {
    const unsigned value = number(bytes[2 * i]) << 8 | number(bytes[2 * i + 1]);
    if (value > kMaxValue) return Outcome::kOutOfRange;
    reading.value[i] = static_cast<std::uint16_t>(value);
  }
  return Outcome::kOk;
}

// Fourteen values of 12 bits, two in three bytes.
void decode_packed(std::span<const std::byte> bytes, Reading& reading) noexcept {
  for (std::size_t i = 0; i < kUltraValues; i += 2) {
    const auto at = bytes.subspan(i / 2 * 3, 3);
    reading.value[i] = static_cast<std::uint16_t>(number(at[0]) << 4 | number(at[1]) >> 4);
    reading.value[i + 1] = static_cast<std::uint16_t>((number(at[1]) & 0xF) << 8 | number(at[2]));
  }
}

void encode_words(const Reading& reading, std::span<std::byte> bytes) {
  for (std::size_t i = 0; i < kMaxValues; ++i) {
    bytes[2 * i] = static_cast<std::byte>(reading.value[i] >> 8);
    bytes[2 * i + 1] = static_cast<std::byte>(reading.value[i] & 0xFF);
  }
}

std::vector<std::byte> encode_five(const Reading& reading) {
  std::vector<std::byte> bytes(kFiveBytes);
  bytes[0] = kFiveStart;
  for (std::size_t i = 0; i < kFingers; ++i) {
    bytes[1 + i] = static_cast<std::byte>(reading.value[i]);
  }
  bytes[6] = std::byte{reading.pitch};
  bytes[7] = std::byte{reading.roll};
  bytes[8] = xor_of(std::span(bytes).subspan(1, 7));
  return bytes;
}

std::vector<std::byte> encode_sixteen(const Reading& reading) {
  if (reading.kind == Reading::Kind::kInfo) {
    return {kWideStart,   std::byte{'I'}, std::byte{1}, std::byte{0}, std::byte{reading.right},
            std::byte{1}, std::byte{'>'}};
  }
  std::vector<std::byte> bytes(kSixteenBytes);
  bytes[0] = kWideStart;
  bytes[1] = std::byte{'D'};
  encode_words(reading, std::span(bytes).subspan(2));
  bytes[kSixteenBytes - 1] = std::byte{'>'};
  return bytes;
}

std::vector<std::byte> encode_ultra(const Reading& reading) {
  std::vector<std::byte> bytes(kUltraBytes);
  bytes[0] = kWideStart;
  bytes[1] = std::byte{static_cast<unsigned char>(reading.port_b ? 4 : 2)};
  for (std::size_t i = 0; i < kUltraValues; i += 2) {
    const unsigned pair = static_cast<unsigned>(reading.value[i]) << 12 | reading.value[i + 1];
    for (std::size_t k = 0; k < 3; ++k) {
      bytes[kUltraAt + i / 2 * 3 + k] = static_cast<std::byte>(pair >> (16 - 8 * k) & 0xFF);
    }
  }
  return bytes;
}

}  // namespace

RT_SAFE bool is_usb(Form form) noexcept {
  return form == Form::kUltraUsb5 || form == Form::kUltraUsb14;
}

std::size_t sensors_of(Form form) noexcept {
  constexpr std::array<std::size_t, 6> kSensors{5, 5, 16, 14, 5, 14};
  return kSensors[static_cast<std::size_t>(form)];
}

RT_SAFE std::size_t packet_bytes(Form form) noexcept {
  constexpr std::array<std::size_t, 6> kBytes{kFiveBytes,  kFiveBytes, kSixteenBytes,
                                              kUltraBytes, kUsbBytes,  kUsbBytes};
  return kBytes[static_cast<std::size_t>(form)];
}

RT_SAFE std::size_t value_of_sensor(Form form, std::size_t index) noexcept {
  return form == Form::kUltraUsb5 ? 3 * index : index;
}

RT_SAFE std::size_t packet_length(Form form, std::span<const std::byte> bytes) noexcept {
  switch (form) {
    case Form::kFive:
    case Form::kFiveWireless:
      return bytes[0] == kFiveStart ? kFiveBytes : 0;
    case Form::kSixteen:
      if (bytes[0] != kWideStart) return 0;
      if (bytes.size() < 2) return 2;
      if (bytes[1] == std::byte{'I'}) return kWideInfoBytes;
      return bytes[1] == std::byte{'D'} ? kSixteenBytes : 0;
    case Form::kUltraWireless:
      return bytes[0] == kWideStart ? kUltraBytes : 0;
    default:
      return kUsbBytes;
  }
}

RT_SAFE Outcome decode_packet(Form form, std::span<const std::byte> bytes,
                              Reading& reading) noexcept {
  reading = {};
  switch (form) {
    case Form::kFive:
    case Form::kFiveWireless:
      return decode_five(bytes, reading);
    case Form::kSixteen:
      if (bytes.size() == kSixteenBytes) return decode_words(bytes.subspan(2), reading);
      reading.kind = Reading::Kind::kInfo;
      reading.right = (bytes[4] & std::byte{1}) != std::byte{0};
      return Outcome::kOk;
    case Form::kUltraWireless: {
      const unsigned port = number(bytes[1]) & 0xF;
      reading.port_b = port != 2 && port != 3;
      decode_packed(bytes.subspan(kUltraAt), reading);
      return Outcome::kOk;
    }
    default:
      return decode_words(bytes, reading);
  }
}

std::vector<std::byte> encode_packet(Form form, const Reading& reading, Side side) {
  switch (form) {
    case Form::kFive:
      return encode_five(reading);
    case Form::kFiveWireless: {
      auto bytes = encode_five(reading);
      bytes.push_back(side == Side::kRight ? std::byte{0x01} : std::byte{0x40});
      return bytes;
    }
    case Form::kSixteen:
      return encode_sixteen(reading);
    case Form::kUltraWireless:
      return encode_ultra(reading);
    default: {
      std::vector<std::byte> bytes(kUsbBytes);
      encode_words(reading, bytes);
      return bytes;
    }
  }
}

std::vector<std::byte> encode_info(Side side) {
  std::vector<std::byte> bytes(kInfoBytes);
  bytes[0] = std::byte{'B'};
  bytes[1] = std::byte{'R'};
  bytes[2] = std::byte{2};
  bytes[4] = side == Side::kRight ? std::byte{0x11} : std::byte{0x10};
  constexpr std::string_view kGloveName = "DataGlove";
  std::ranges::transform(kGloveName, bytes.begin() + 16,
                         [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

RT_SAFE bool is_capability(std::byte byte) noexcept {
  return byte == std::byte{0x00} || byte == std::byte{0x01} || says_left(byte);
}

RT_SAFE bool says_left(std::byte capability) noexcept {
  return capability == std::byte{0x06} || capability == std::byte{0x40};
}

}  // namespace posed::drivers::fivedt
