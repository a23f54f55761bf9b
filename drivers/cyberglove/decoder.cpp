#include "drivers/cyberglove/decoder.hpp"

#include <algorithm>
#include <limits>

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

RT_SAFE void Decoder8::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
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

RT_SAFE void Decoder8::accept_piece(Sink& sink) noexcept {
  if (lost_ || size_ == 0) return;                // already counted; or the end of an answer
  if (size_ == 1 && piece_[0] == kTouch) return;  // the answer to a CyberTouch command
  const std::span<const std::byte> piece = std::span(piece_).first(size_);
  const Outcome outcome = check_piece(piece);
  sink.outcome(outcome);
  if (outcome == Outcome::kOk) accept_sample(piece, sink);
}

RT_SAFE Outcome Decoder8::check_piece(std::span<const std::byte> piece) const noexcept {
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

RT_SAFE void Decoder8::accept_sample(std::span<const std::byte> piece, Sink& sink) noexcept {
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

namespace {

// Sequences seen between records: "1S", the echo of the start command, and "nS" or "e1S", which the
// authors of Shadow's driver saw.
constexpr std::size_t kKnownStrays = 3;
constexpr unsigned kMaxValue = 0x0FFF;
constexpr float kSteps = 16.0F;  // per 8-bit count, so that both forms share calibrations

}  // namespace

RT_SAFE void Decoder16::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                             Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    record_[size_++] = byte;
    if (!could_be_record()) hunt(sink);
    if (size_ == kRecordBytes) accept_record(sink);
  }
}

// Checks the last byte only; those before were checked when they arrived.
RT_SAFE bool Decoder16::could_be_record() const noexcept {
  const std::size_t place = size_ - 1;
  if (place < kRecordHead) return fits_pattern(place, record_[place]);
  constexpr std::size_t kEndAt = kRecordBytes - kRecordEnd.size();
  return place < kEndAt || record_[place] == kRecordEnd[place - kEndAt];
}

// The bytes were not a record; searches for the next one, which may begin inside them.
RT_SAFE void Decoder16::hunt(Sink& sink) noexcept {
  std::size_t from = 1;
  for (; from < size_; ++from) {
    const std::size_t head = std::min(size_ - from, kRecordHead);
    std::size_t fits = 0;
    while (fits < head && fits_pattern(fits, record_[from + fits])) ++fits;
    if (fits == head) break;
  }
  strays_ += from;
  if (strays_ > kKnownStrays && !reported_) {
    sink.outcome(Outcome::kForeign);
    reported_ = true;
  }
  std::copy(record_.begin() + static_cast<std::ptrdiff_t>(from),
            record_.begin() + static_cast<std::ptrdiff_t>(size_), record_.begin());
  size_ -= from;
}

RT_SAFE void Decoder16::accept_record(Sink& sink) noexcept {
  size_ = 0;
  strays_ = 0;
  reported_ = false;
  std::array<float, kSensors> raw{};
  std::size_t place = kRecordHead;
  for (std::size_t i = 0; i < kSensors; ++i) {
    if ((kMask22 >> i & 1U) == 0) continue;  // records have a field for all 22
    const unsigned value = std::to_integer<unsigned>(record_[place]) << 8 |
                           std::to_integer<unsigned>(record_[place + 1]);
    place += 2;
    if ((layout().mask >> i & 1U) == 0) continue;  // the field is unused on an 18-sensor glove
    if (value == 0 || value > kMaxValue) return sink.outcome(Outcome::kOutOfRange);
    raw[i] = static_cast<float>(value) / kSteps;
  }
  const std::int64_t sub_frames =
      decode_time_of_day(std::span(record_).first<kRecordHead>(), layout().multiplier);
  if (sub_frames < 0) return sink.outcome(Outcome::kOutOfRange);
  sink.outcome(Outcome::kOk);
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  constexpr std::array<float, kExtras> kExtra{kUnknown, kUnknown};
  emit({.raw = raw,
        .valid = layout().mask,
        .extra = kExtra,
        .device_ns = clock_.to(sub_frames) * 1'000'000'000 / (kFrames_hz * layout().multiplier)},
       sink);
}

}  // namespace posed::drivers::cyberglove
