#include "drivers/cyberglove/protocol.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace posed::drivers::cyberglove {
namespace {

constexpr int kMaxWord = 65535;

std::int64_t digit(std::span<const std::byte, kRecordHead> head, std::size_t place) noexcept {
  return std::to_integer<int>(head[place]) - '0';
}

std::int64_t pair(std::span<const std::byte, kRecordHead> head, std::size_t place) noexcept {
  return 10 * digit(head, place) + digit(head, place + 1);
}

}  // namespace

RT_SAFE std::size_t sample_bytes(const Layout& layout) noexcept {
  return 1 + static_cast<std::size_t>(std::popcount(layout.mask)) +
         (layout.time ? kStampBytes : 0) + (layout.status ? 1 : 0);
}

RT_SAFE bool decode_stamp(std::span<const std::byte, kStampBytes> bytes,
                          std::uint32_t& count) noexcept {
  const auto flags = std::to_integer<unsigned>(bytes[0]);
  count = 0;
  for (unsigned k = 0; k < 4; ++k) {
    const auto byte = std::to_integer<std::uint32_t>(bytes[1 + k]);
    const bool was_zero = (flags >> k & 1U) != 0;
    if (was_zero && byte != 1) return false;
    if (!was_zero) count |= byte << 8 * k;
  }
  return true;
}

std::array<std::byte, kStampBytes> encode_stamp(std::uint32_t count) noexcept {
  std::array<std::byte, kStampBytes> bytes{std::byte{0x80}};
  for (unsigned k = 0; k < 4; ++k) {
    const auto byte = static_cast<std::byte>(count >> 8 * k & 0xFF);
    if (byte == std::byte{0}) bytes[0] |= static_cast<std::byte>(1U << k);
    bytes[1 + k] = byte == std::byte{0} ? std::byte{1} : byte;
  }
  return bytes;
}

RT_SAFE std::int64_t decode_time_of_day(std::span<const std::byte, kRecordHead> head,
                                        int multiplier) noexcept {
  const std::int64_t hours = pair(head, 0);
  const std::int64_t minutes = pair(head, 3);
  const std::int64_t seconds = pair(head, 6);
  const std::int64_t frame = pair(head, 9);  // the manual counts 00 to 29, Shadow's driver 1 to 30
  const std::int64_t sub_frame = digit(head, 12);
  if (hours > 23 || minutes > 59 || seconds > 59 || frame > kFrames_hz ||
      sub_frame >= kMaxMultiplier) {
    return -1;
  }
  return (((hours * 60 + minutes) * 60 + seconds) * kFrames_hz + frame) * multiplier + sub_frame;
}

std::array<std::byte, kRecordHead> encode_time_of_day(std::int64_t sub_frames,
                                                      int multiplier) noexcept {
  const std::int64_t frames = sub_frames / multiplier;
  const std::int64_t seconds = frames / kFrames_hz;
  const std::array<std::int64_t, 4> pairs{seconds / 3600 % 24, seconds / 60 % 60, seconds % 60,
                                          frames % kFrames_hz};
  std::array<std::byte, kRecordHead> head{};
  const auto put = [&](std::size_t place, std::int64_t value) {
    head[place] = static_cast<std::byte>('0' + value);
  };
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    put(3 * p, pairs[p] / 10);
    put(3 * p + 1, pairs[p] % 10);
    head[3 * p + 2] = std::byte{':'};
  }
  put(12, sub_frames % multiplier);
  head[13] = std::byte{'S'};
  return head;
}

Period period_of(double rate_hz) noexcept {
  if (!(rate_hz > 0.0)) return {};
  const double ticks = kTicks_hz / rate_hz;
  const double w2 = std::clamp(std::ceil(ticks / kMaxWord), 1.0, double{kMaxWord});
  const double w1 = std::clamp(std::round(ticks / w2), 1.0, double{kMaxWord});
  return {.w1 = static_cast<std::uint16_t>(w1), .w2 = static_cast<std::uint16_t>(w2)};
}

}  // namespace posed::drivers::cyberglove
