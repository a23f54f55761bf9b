#include <algorithm>
#include <limits>

#include "drivers/cyberglove/decoder.hpp"

namespace posed::drivers::cyberglove {
namespace {

// Sequences seen between records: "1S", the echo of the start command, and "nS" or "e1S", which the
// authors of Shadow's driver saw.
constexpr std::size_t kKnownStrays = 3;
constexpr unsigned kMaxValue = 0x0FFF;
constexpr float kSteps = 16.0F;  // per 8-bit count, so that both forms share calibrations

}  // namespace

// RT-safe.
void Decoder16::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                     Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    record_[size_++] = byte;
    if (!could_be_record()) hunt(sink);
    if (size_ == kRecordBytes) accept_record(sink);
  }
}

// Checks the last byte only; those before were checked when they arrived. RT-safe.
bool Decoder16::could_be_record() const noexcept {
  const std::size_t place = size_ - 1;
  if (place < kRecordHead) return fits_pattern(place, record_[place]);
  constexpr std::size_t kEndAt = kRecordBytes - kRecordEnd.size();
  return place < kEndAt || record_[place] == kRecordEnd[place - kEndAt];
}

// The bytes were not a record; searches for the next one, which may begin inside them. RT-safe.
void Decoder16::hunt(Sink& sink) noexcept {
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

// RT-safe.
void Decoder16::accept_record(Sink& sink) noexcept {
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
