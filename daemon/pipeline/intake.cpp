#include "daemon/pipeline/intake.hpp"

#include "posed/v1/posed.pb.h"

namespace posed::pipeline {

void Intake::frame(std::size_t body, Frame& frame) noexcept {
  if (body != 0) return outcome(Outcome::kForeign);
  frame.header.stream = stream_;
  frame.header.sequence = ++frames_;
  frame.header.arrival_ns = arrival_ns_;
  clock_.stamp(frame);
  if (clock_.jumps() != jumps_reported_) {
    jumps_reported_ = clock_.jumps();
    // If the ring is full the event is lost like a frame would be, and its number is skipped.
    if (!report(v1::Event::KIND_CLOCK_JUMPED, 0)) ++next_item_;
  }
  item_.kind = Item::Kind::kFrame;
  item_.frame = frame;
  put();
}

void Intake::sample(std::size_t body, Sample& sample) noexcept {
  if (body != 0) return outcome(Outcome::kForeign);
  sample.header.stream = stream_;
  sample.header.sequence = ++samples_;
  sample.header.arrival_ns = arrival_ns_;
  item_.kind = Item::Kind::kSample;
  item_.sample = sample;
  put();
}

bool Intake::report(std::uint8_t event, std::uint64_t ticket, std::string_view name) noexcept {
  item_.kind = Item::Kind::kEvent;
  item_.number = next_item_;
  item_.stream_event = {stream_, event, arrival_ns_, frames_, 0.0, ticket};
  item_.stream_event.after = ShortText(name);
  if (!out_.item(item_)) return false;
  ++next_item_;
  return true;
}

void Intake::put() noexcept {
  item_.number = next_item_++;
  static_cast<void>(out_.item(item_));
}

}  // namespace posed::pipeline
