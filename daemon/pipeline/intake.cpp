#include "daemon/pipeline/intake.hpp"

#include <cassert>

#include "posed/v1/posed.pb.h"

namespace posed::pipeline {

void Intake::set_streams(std::span<const StreamPosition> of_body) noexcept {
  assert(of_body.size() <= kMaxBodies);
  count_ = 0;
  place_of_.fill(kNoPlace);
  for (std::size_t body = 0; body < of_body.size(); ++body) {
    if (of_body[body].stream == kNoStream) continue;
    place_of_[body] = static_cast<std::uint8_t>(count_);
    streams_[count_++] = of_body[body];
  }
}

void Intake::go_to(const Position& next) noexcept {
  next_item_ = next.item;
  for (const StreamPosition& position : next.streams) {
    for (std::size_t place = 0; place < count_; ++place) {
      if (streams_[place].stream == position.stream) streams_[place] = position;
    }
  }
}

void Intake::frame(std::size_t body, Frame& frame) noexcept {
  const std::uint8_t place = place_of(body);
  if (place == kNoPlace) return;
  frame.header.stream = streams_[place].stream;
  frame.header.sequence = streams_[place].frame++;
  frame.header.arrival_ns = arrival_ns_;
  clock_.stamp(frame);
  if (clock_.jumps() != jumps_reported_) report_jump();
  item_.kind = Item::Kind::kFrame;
  item_.frame = frame;
  put(place);
}

// The clock is that of all bodies.
void Intake::report_jump() noexcept {
  jumps_reported_ = clock_.jumps();
  for (std::size_t place = 0; place < count_; ++place) {
    // If the ring is full the event is lost like a frame would be, and its number is skipped.
    if (!report(place, v1::Event::KIND_CLOCK_JUMPED, 0)) ++next_item_;
  }
}

void Intake::sample(std::size_t body, Sample& sample) noexcept {
  const std::uint8_t place = place_of(body);
  if (place == kNoPlace) return;
  sample.header.stream = streams_[place].stream;
  sample.header.sequence = streams_[place].sample++;
  sample.header.arrival_ns = arrival_ns_;
  item_.kind = Item::Kind::kSample;
  item_.sample = sample;
  put(place);
}

bool Intake::report(std::size_t place, std::uint8_t event, std::uint64_t ticket,
                    std::string_view name) noexcept {
  return put_event(place, {.kind = event, .ticket = ticket, .after = ShortText(name)});
}

bool Intake::report_end(std::size_t place, bool leaves) noexcept {
  return put_event(place, {.kind = v1::Event::KIND_ENDED, .leaves = leaves});
}

bool Intake::put_event(std::size_t place, const StreamEvent& event) noexcept {
  assert(place < count_);
  const StreamPosition& stream = streams_[place];
  item_.kind = Item::Kind::kEvent;
  item_.number = next_item_;
  item_.stream_event = event;
  item_.stream_event.stream = stream.stream;
  item_.stream_event.time_ns = arrival_ns_;
  item_.stream_event.sequence = stream.frame - 1;
  item_.stream_event.last_sample = stream.sample - 1;
  if (!out_.item(place, item_)) return false;
  ++next_item_;
  return true;
}

void Intake::put(std::size_t place) noexcept {
  item_.number = next_item_++;
  static_cast<void>(out_.item(place, item_));
}

}  // namespace posed::pipeline
