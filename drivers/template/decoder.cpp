#include "drivers/template/decoder.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/time.hpp"

namespace posed::drivers::bend {

// RT-safe.
void BendDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                       Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    if (pending_bytes_ == 0 && byte != kStart) {
      if (in_step_) sink.outcome(Outcome::kForeign);
      in_step_ = false;
      continue;
    }
    pending_[pending_bytes_++] = byte;
    if (pending_bytes_ == kPacketBytes) take_packet(sink);
  }
}

// RT-safe.
void BendDecoder::take_packet(Sink& sink) noexcept {
  Packet packet;
  const Outcome outcome = decode_packet(pending_, packet);
  if (outcome == Outcome::kBadChecksum) {
    // An apparent start may have been data: the real start may be inside these bytes.
    if (in_step_) sink.outcome(outcome);
    in_step_ = false;
    resynchronise();
    return;
  }
  pending_bytes_ = 0;
  in_step_ = true;
  sink.outcome(outcome);
  if (outcome == Outcome::kOk) emit(packet, sink);
}

// RT-safe.
void BendDecoder::resynchronise() noexcept {
  const auto end = pending_.begin() + static_cast<std::ptrdiff_t>(pending_bytes_);
  const auto next = std::find(pending_.begin() + 1, end, kStart);
  std::copy(next, end, pending_.begin());
  pending_bytes_ = static_cast<std::size_t>(end - next);
}

// RT-safe.
std::int64_t BendDecoder::device_time_ns(std::uint8_t count) noexcept {
  if (has_count_) {
    // Equal counts are a whole turn of the counter apart: time always advances.
    const int step = (count - count_ + 255) % 256 + 1;
    packets_ += step;
  }
  has_count_ = true;
  count_ = count;
  return std::llround(static_cast<double>(packets_) * period_ns_);
}

// RT-safe.
void BendDecoder::emit(const Packet& packet, Sink& sink) noexcept {
  const std::int64_t device_ns = device_time_ns(packet.count);
  Frame frame;
  frame.header.device_ns = device_ns;
  frame.source = Source::kDevice;
  const std::array values{static_cast<double>(packet.bend_rad)};  // the skeleton's one channel
  pose_from_channels(*skeleton_, values, frame);
  sink.frame(frame);

  Sample sample;
  sample.header.device_ns = device_ns;
  sample.value_count = 2;
  sample.value[0] = packet.bend_rad;
  sample.value[1] = packet.battery;
  sample.valid[0] = sample.valid[1] = true;
  sink.sample(sample);
}

}  // namespace posed::drivers::bend
