// Intake turns the output of one stream's decoder into items. It stamps frames and samples with
// stream, sequence and arrival, maps the device's clock to the host's, emits an event when that
// clock jumps, and numbers every item. The live reader and `replay` use the same class, so the same
// chunks give the same items.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/pipeline/device_clock.hpp"
#include "daemon/pipeline/messages.hpp"
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

  // Takes an item, which already has its number; items come in order. Returns false if the ring was
  // full and the item is lost.
  virtual bool item(Item& item) noexcept = 0;
  virtual void outcome(Outcome outcome) noexcept = 0;
};

// All calls come from one thread and are RT-safe.
class Intake final : public Sink {
 public:
  // `next_item` is shared by all intakes of one reader and outlives them, as does `out`.
  Intake(std::uint32_t stream, std::uint64_t& next_item, IntakeOut& out) noexcept
      : stream_(stream), next_item_(next_item), out_(out) {}

  // Call before bytes are given to the decoder, with their arrival time. Events get that time, too.
  void arrived(std::int64_t arrival_ns) noexcept { arrival_ns_ = arrival_ns; }

  // A new link to the device was opened: nothing is known of its clock yet.
  void new_link() noexcept { clock_.restart(); }

  // The numbers that the next frame, sample and item will get.
  [[nodiscard]] Position next() const noexcept {
    return {.frame = frames_ + 1, .sample = samples_ + 1, .item = next_item_};
  }
  // For replay, which sets the numbers from the log so that they are right again after a gap. The
  // item number is the one that all intakes share.
  void go_to(const Position& next) noexcept {
    frames_ = next.frame - 1;
    samples_ = next.sample - 1;
    next_item_ = next.item;
  }

  // Emits an event of the reader between two chunks. Returns false, without using up a number, if
  // the ring is full; the caller may try again. `name` is the calibration that the event is about.
  [[nodiscard]] bool report(std::uint8_t event, std::uint64_t ticket,
                            std::string_view name = {}) noexcept;

  // Sink: called by the decoder.
  // Only body 0 has a stream; what comes of other bodies is counted as foreign.
  void frame(std::size_t body, Frame& frame) noexcept override;
  void sample(std::size_t body, Sample& sample) noexcept override;
  void outcome(Outcome outcome) noexcept override { out_.outcome(outcome); }

 private:
  // Hands item_ over. It uses up a number even if the ring is full.
  void put() noexcept;

  std::uint32_t stream_;
  std::uint64_t& next_item_;
  IntakeOut& out_;
  DeviceClock clock_;
  std::uint64_t jumps_reported_ = 0;  // jumps of the device's clock that were already reported
  std::int64_t arrival_ns_ = 0;
  std::uint64_t frames_ = 0;   // sequence of the last frame
  std::uint64_t samples_ = 0;  // sequence of the last sample
  Item item_;                  // kept here because it is large
};

}  // namespace posed::pipeline
