// Intake turns the output of one source's decoder into items. It stamps frames and samples with the
// stream of their body, sequence and arrival, maps the device's clock to the host's, emits an event
// when that clock jumps, and numbers every item. The live reader and `replay` use the same class,
// so the same chunks give the same items.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "daemon/pipeline/messages.hpp"
#include "drivers/device_clock.hpp"
#include "proto/frame/sink.hpp"

namespace posed::pipeline {

// Receives the items of an intake. Live this is the ring to the pipeline, in replay the stream's
// engine.
class IntakeOut {
 public:
  IntakeOut() = default;
  IntakeOut(const IntakeOut&) = delete;
  IntakeOut& operator=(const IntakeOut&) = delete;
  virtual ~IntakeOut() = default;

  // Takes an item, which already has its number; items come in order. `place` is the index of its
  // stream in Intake::next().streams. Returns false if the ring was full and the item is lost.
  virtual bool item(std::size_t place, Item& item) noexcept = 0;
  virtual void outcome(Outcome outcome) noexcept = 0;
  // The device has described its bodies.
  virtual void description(std::span<const std::byte> /*bytes*/) noexcept {}
};

// All calls come from one thread and are RT-safe.
class Intake final : public Sink {
 public:
  // `next_item` is shared by all intakes of one reader and outlives them, as does `out`.
  Intake(std::uint64_t& next_item, IntakeOut& out) noexcept : next_item_(next_item), out_(out) {
    place_of_.fill(kNoPlace);
  }

  // From the next frame on, the bodies [body] are these streams, and their numbers go on from here;
  // kNoStream: frames of the body are left out. At most kMaxBodies.
  void set_streams(std::span<const StreamPosition> of_body) noexcept;

  // Call before bytes are given to the decoder, with their arrival time. Events get that time, too.
  void arrived(std::int64_t arrival_ns) noexcept { arrival_ns_ = arrival_ns; }

  // A new link to the device was opened: nothing is known of its clock yet.
  void new_link() noexcept { clock_.restart(); }

  // The numbers that the next frames, samples and item will get.
  [[nodiscard]] Position next() const noexcept {
    return {.item = next_item_, .streams = std::span(streams_).first(count_)};
  }
  // For replay, which sets the numbers from the log so that they are right again after a gap.
  // Numbers of streams that the source does not have now are ignored. The item number is the one
  // that all intakes share.
  void go_to(const Position& next) noexcept;

  // Emits an event of the reader between two chunks. Returns false, without using up a number, if
  // the ring is full; the caller may try again. `name` is the calibration that the event is about.
  [[nodiscard]] bool report(std::size_t place, std::uint8_t event, std::uint64_t ticket,
                            std::string_view name = {}) noexcept;
  // Emits the end of a stream in the same way; `leaves` as in StreamEvent.
  [[nodiscard]] bool report_end(std::size_t place, bool leaves) noexcept;

  // Sink: called by the decoder.
  void frame(std::size_t body, Frame& frame) noexcept override;
  void sample(std::size_t body, Sample& sample) noexcept override;
  using Sink::frame;
  using Sink::sample;
  void outcome(Outcome outcome) noexcept override { out_.outcome(outcome); }
  void description(std::span<const std::byte> bytes) noexcept override { out_.description(bytes); }

 private:
  static constexpr std::uint8_t kNoPlace = 0xff;

  [[nodiscard]] std::uint8_t place_of(std::size_t body) const noexcept {
    return body < place_of_.size() ? place_of_[body] : kNoPlace;
  }
  void report_jump() noexcept;
  [[nodiscard]] bool put_event(std::size_t place, const StreamEvent& event) noexcept;
  // Hands item_ over. It uses up a number even if the ring is full.
  void put(std::size_t place) noexcept;

  std::uint64_t& next_item_;
  IntakeOut& out_;
  drivers::DeviceClock clock_;
  std::uint64_t jumps_reported_ = 0;  // jumps of the device's clock that were already reported
  std::int64_t arrival_ns_ = 0;
  std::array<std::uint8_t, kMaxBodies> place_of_{};  // [body] index in streams_
  std::array<StreamPosition, kMaxBodies> streams_{};
  std::size_t count_ = 0;  // of streams_
  Item item_;              // kept here because it is large
};

}  // namespace posed::pipeline
