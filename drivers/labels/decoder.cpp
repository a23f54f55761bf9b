#include "drivers/labels/decoder.hpp"

#include <utility>

#include "proto/frame/time.hpp"

namespace posed::drivers {

LabelsDecoder::LabelsDecoder(const Frame& rest, double rate_hz) : rest_(rest), rate_hz_(rate_hz) {
  rest_.header = {};
  rest_.source = Source::kLabels;
  rest_.quality = Quality::kHeld;
}

RT_SAFE void LabelsDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                 Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    if (static_cast<char>(byte) != kBeat.front()) {
      if (!std::exchange(foreign_, true)) sink.outcome(Outcome::kForeign);
      continue;
    }
    foreign_ = false;
    rest_.header.device_ns = nanoseconds(static_cast<double>(beats_++) / rate_hz_);
    sink.outcome(Outcome::kOk);
    sink.frame(rest_);
  }
}

}  // namespace posed::drivers
