#include <algorithm>
#include <limits>

#include "drivers/cyberglove/decoder.hpp"

namespace posed::drivers::cyberglove {
namespace {

constexpr std::byte kEnd{0};

// True when the pairs after a sample report that the glove is unplugged.
bool says_unplugged(std::span<const std::byte> pairs) noexcept {
  for (std::size_t i = 1; i < pairs.size(); i += 2) {
    if (pairs[i] == std::byte{'g'}) return true;
  }
  return false;
}

bool are_pairs(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() % 2 != 0 || bytes.size() > 2 * kMaxPairs) return false;
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    if (bytes[i] != std::byte{'e'}) return false;
    if (bytes[i + 1] != std::byte{'s'} && bytes[i + 1] != std::byte{'g'}) return false;
  }
  return true;
}

}  // namespace

// RT-safe.
void Decoder8::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                    Sink& sink) noexcept {
  // A stamp's flags are zero on gloves that never set their bit 7 (the author of Vista saw one).
  const std::size_t flags = sample_bytes(layout()) - kStampBytes - (layout().status ? 1 : 0);
  for (const std::byte byte : bytes) {
    if (byte == kEnd && !(layout().time && !lost_ && size_ == flags)) {
      accept_piece(sink);
      size_ = 0;
      lost_ = false;
    } else if (size_ == piece_.size()) {
      if (!lost_) sink.outcome(Outcome::kForeign);
      lost_ = true;
    } else {
      piece_[size_++] = byte;
    }
  }
}

// RT-safe.
void Decoder8::accept_piece(Sink& sink) noexcept {
  if (lost_ || size_ == 0) return;                // already counted; or the end of an answer
  if (size_ == 1 && piece_[0] == kTouch) return;  // the answer to a CyberTouch command
  const std::span<const std::byte> piece = std::span(piece_).first(size_);
  const Outcome outcome = check_piece(piece);
  sink.outcome(outcome);
  if (outcome == Outcome::kOk) accept_sample(piece, sink);
}

// RT-safe.
Outcome Decoder8::check_piece(std::span<const std::byte> piece) const noexcept {
  const std::size_t size = sample_bytes(layout());
  if (piece[0] != lead(layout().mode)) return Outcome::kForeign;
  if (piece.size() < size) return Outcome::kShort;
  const std::span<const std::byte> pairs = piece.subspan(size);
  if (!are_pairs(pairs)) return Outcome::kForeign;
  if (says_unplugged(pairs)) return Outcome::kOutOfRange;
  if (layout().status) {
    const std::byte status = piece[size - 1];
    if ((status & kStatusMark) == std::byte{0}) return Outcome::kForeign;
    if ((status & kPluggedIn) == std::byte{0}) return Outcome::kOutOfRange;
  }
  std::uint32_t count = 0;
  if (layout().time) {
    const std::size_t stamp = size - kStampBytes - (layout().status ? 1 : 0);
    if (!decode_stamp(piece.subspan(stamp).first<kStampBytes>(), count)) return Outcome::kForeign;
  }
  return Outcome::kOk;
}

// RT-safe.
void Decoder8::accept_sample(std::span<const std::byte> piece, Sink& sink) noexcept {
  std::array<float, kSensors> raw{};
  std::size_t place = 1;
  for (std::size_t i = 0; i < kSensors; ++i) {
    if ((layout().mask >> i & 1U) != 0) raw[i] = std::to_integer<std::uint8_t>(piece[place++]);
  }
  glove::Packet packet{.raw = raw, .valid = layout().mask, .extra = {}};
  if (layout().time) {
    std::uint32_t count = 0;
    (void)decode_stamp(piece.subspan(place).first<kStampBytes>(), count);  // checked before
    place += kStampBytes;
    constexpr std::int64_t kNs = 78125, kTicks = 9;  // 9 ticks of 1/115200 s are 78125 ns
    packet.device_ns = clock_.to(count) * kNs / kTicks;
  }
  // A polled glove may repeat an old measurement; the stamp, if there is one, shows whether it did.
  const std::span<const std::byte> measured = piece.subspan(1, place - 1);
  if (layout().mode == Mode::kPoll &&
      std::ranges::equal(measured, std::span(before_).first(measured.size()))) {
    packet.quality = Quality::kHeld;
  }
  std::ranges::copy(measured, before_.begin());
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  std::array<float, kExtras> extra{kUnknown, kUnknown};
  if (layout().status) {
    extra[0] = (piece[place] & kSwitch) != std::byte{0} ? 1.0F : 0.0F;
    extra[1] = (piece[place] & kLight) != std::byte{0} ? 1.0F : 0.0F;
  }
  packet.extra = extra;
  emit(packet, sink);
}

}  // namespace posed::drivers::cyberglove
