#include "drivers/p5/protocol.hpp"

#include <cstdlib>

namespace posed::drivers::p5 {
namespace {

constexpr std::byte kInputReport{1};
constexpr std::size_t kBendsAt = 8;
constexpr std::size_t kButtonsAt = 40;
constexpr std::size_t kNamesAt = 44;
constexpr std::size_t kValuesAt = 60;
constexpr std::array<std::size_t, kFingers> kBendOrder{1, 2, 3, 4, 0};  // [in the report] = finger

unsigned bits(std::span<const std::byte> bytes, std::size_t at, std::size_t count) noexcept {
  unsigned value = 0;
  for (std::size_t i = at; i < at + count; ++i) {
    value = value << 1 | (std::to_integer<unsigned>(bytes[i / 8]) >> (7 - i % 8) & 1U);
  }
  return value;
}

void put_bits(std::span<std::byte> bytes, std::size_t at, std::size_t count,
              unsigned value) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned bit = value >> (count - 1 - i) & 1U;
    bytes[(at + i) / 8] |= static_cast<std::byte>(bit << (7 - (at + i) % 8));
  }
}

std::int16_t signed_10(unsigned value) noexcept {
  return static_cast<std::int16_t>(static_cast<int>(value) - (value >= 512 ? 1024 : 0));
}

}  // namespace

RT_SAFE Outcome decode_report(std::span<const std::byte> bytes, Report& report) noexcept {
  if (bytes[0] != kInputReport) return Outcome::kForeign;
  report = {};
  for (std::size_t i = 0; i < kFingers; ++i) {
    report.bend[kBendOrder[i]] = static_cast<std::uint8_t>(bits(bytes, kBendsAt + 6 * i, 6));
  }
  report.buttons = static_cast<std::uint8_t>(bits(bytes, kButtonsAt, 4));
  for (std::size_t i = 0; i < kSpots; ++i) {
    LedObservation& spot = report.spot[i];
    const std::size_t at = kValuesAt + 30 * i;
    spot.led = static_cast<std::uint8_t>(bits(bytes, kNamesAt + 4 * i, 4));
    spot.v2 = signed_10(bits(bytes, at, 10));
    spot.v1 = signed_10(bits(bytes, at + 10, 10));
    spot.h = signed_10(bits(bytes, at + 20, 10));
  }
  return Outcome::kOk;
}

std::array<std::byte, kReportBytes> encode_report(const Report& report) noexcept {
  std::array<std::byte, kReportBytes> bytes{kInputReport};
  for (std::size_t i = 0; i < kFingers; ++i) {
    put_bits(bytes, kBendsAt + 6 * i, 6, report.bend[kBendOrder[i]]);
  }
  put_bits(bytes, kButtonsAt, 4, report.buttons);
  for (std::size_t i = 0; i < kSpots; ++i) {
    const LedObservation& spot = report.spot[i];
    const std::size_t at = kValuesAt + 30 * i;
    put_bits(bytes, kNamesAt + 4 * i, 4, spot.led);
    put_bits(bytes, at, 10, static_cast<std::uint16_t>(spot.v2));
    put_bits(bytes, at + 10, 10, static_cast<std::uint16_t>(spot.v1));
    put_bits(bytes, at + 20, 10, static_cast<std::uint16_t>(spot.h));
  }
  return bytes;
}

RT_SAFE std::int16_t unwrapped(std::int16_t value, std::int16_t before) noexcept {
  constexpr int kEdge = 409;  // beyond it a value may have wrapped
  constexpr int kJump = 670;  // more than a hand moves between two reports
  constexpr int kTurn = 1024;
  if (std::abs(value) < kEdge || std::abs(value - before) < kJump) return value;
  return static_cast<std::int16_t>(value + (value < before ? kTurn : -kTurn));
}

}  // namespace posed::drivers::p5
