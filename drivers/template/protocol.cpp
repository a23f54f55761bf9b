#include "drivers/template/protocol.hpp"

#include <cmath>
#include <string_view>

#include "drivers/rate_text.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::bend {
namespace {

constexpr int kMinBend = -2000;
constexpr int kMaxBend = 12000;
constexpr int kMaxBattery = 100;
constexpr double kUnit_rad = 0.01 * kDegree;
constexpr std::string_view kDeviceInfoPrefix = "BEND1 rate=";

std::byte checksum(std::span<const std::byte, kPacketBytes> bytes) noexcept {
  unsigned sum = 0;
  for (const std::byte byte : bytes.first(kPacketBytes - 1)) sum += std::to_integer<unsigned>(byte);
  return static_cast<std::byte>(sum & 0xFF);
}

}  // namespace

// RT-safe.
Outcome decode_packet(std::span<const std::byte, kPacketBytes> bytes, Packet& packet) noexcept {
  if (bytes[0] != kStart) return Outcome::kForeign;
  if (bytes[kPacketBytes - 1] != checksum(bytes)) return Outcome::kBadChecksum;
  const auto bend = static_cast<std::int16_t>(std::to_integer<int>(bytes[2]) |
                                              std::to_integer<int>(bytes[3]) << 8);
  const int battery = std::to_integer<int>(bytes[4]);
  packet.count = std::to_integer<std::uint8_t>(bytes[1]);
  if (bend < kMinBend || bend > kMaxBend || battery > kMaxBattery) return Outcome::kOutOfRange;
  packet.bend_rad = static_cast<float>(bend * kUnit_rad);
  packet.battery = static_cast<float>(battery) / kMaxBattery;
  return Outcome::kOk;
}

std::array<std::byte, kPacketBytes> encode_packet(const Packet& packet) noexcept {
  const auto bend = static_cast<unsigned>(std::lround(packet.bend_rad / kUnit_rad));
  const auto battery = static_cast<unsigned>(std::lround(packet.battery * kMaxBattery));
  std::array<std::byte, kPacketBytes> bytes{
      kStart, std::byte{packet.count}, static_cast<std::byte>(bend & 0xFF),
      static_cast<std::byte>(bend >> 8 & 0xFF), static_cast<std::byte>(battery & 0xFF)};
  bytes[kPacketBytes - 1] = checksum(bytes);
  return bytes;
}

std::string device_info_text(double rate_hz) {
  return std::string(kDeviceInfoPrefix) + clip::number_text(rate_hz);
}

Result<double> parse_device_info(const std::string& text, const std::string& identity) {
  if (const auto rate_hz = parse_rate(text, kDeviceInfoPrefix, 1e6)) return *rate_hz;
  return fail("does not greet as a bend sensor ('BEND1 rate=100'); is it another device?",
              identity);
}

}  // namespace posed::drivers::bend
