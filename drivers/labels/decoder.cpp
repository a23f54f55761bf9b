#include "drivers/labels/decoder.hpp"

#include <utility>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

LabelsDecoder::LabelsDecoder(std::shared_ptr<const Skeleton> skeleton, double rate_hz)
    : skeleton_(std::move(skeleton)), rate_hz_(rate_hz) {}

// RT-safe.
void LabelsDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                         Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    if (static_cast<char>(byte) != kBeat.front()) {
      if (!std::exchange(foreign_, true)) sink.outcome(Outcome::kForeign);
      continue;
    }
    foreign_ = false;
    Frame frame;
    frame.header.device_ns = nanoseconds(static_cast<double>(beats_++) / rate_hz_);
    frame.source = Source::kLabels;
    frame.quality = Quality::kHeld;
    set_hand_angles(*skeleton_, HandAngles{}, frame);
    sink.outcome(Outcome::kOk);
    sink.frame(frame);
  }
}

}  // namespace posed::drivers
