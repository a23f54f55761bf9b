// Intake: what one stream's decoder emits, turned into items. It stamps frames and samples with
// stream, sequence and arrival, maps the device's clock to the host's, events when that clock
// jumps, and gives every item its number. The live reader and `replay` use the same class, so that
// the same chunks give the same items.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/pipeline/device_clock.hpp"
#include "daemon/pipeline/messages.hpp"
#include "proto/frame/sink.hpp"

namespace posed::pipeline {

// Where an intake puts its items: live the ring to the pipeline, in replay the stream's engine.
class IntakeOut {
 public:
  IntakeOut() = default;
  IntakeOut(const IntakeOut&) = delete;
  IntakeOut& operator=(const IntakeOut&) = delete;
  virtual ~IntakeOut() = default;

  // An item with its number, in order. False: there was no room, and the item is lost.
  virtual bool item(Item& item) noexcept = 0;
  virtual void outcome(Outcome outcome) noexcept = 0;
};

// All calls come from one thread and are RT-safe.
class Intake final : public Sink {
 public:
  // `next_item` is shared by all intakes of one reader and outlives them, as does `out`.
  Intake(std::uint32_t stream, std::uint64_t& next_item, IntakeOut& out) noexcept
      : stream_(stream), next_item_(next_item), out_(out) {}

  // Before bytes are fed to the decoder: when they came. Notices get that time, too.
  void arrived(std::int64_t arrival_ns) noexcept { arrival_ns_ = arrival_ns; }

  // Another link to the device: nothing is known of its clock.
  void new_link() noexcept { clock_.restart(); }

  // The numbers of what comes next.
  [[nodiscard]] Position next() const noexcept {
    return {.frame = frames_ + 1, .sample = samples_ + 1, .item = next_item_};
  }
  // For replay, which takes the numbers from the log, so that it is right again after a gap. The
  // item number is the one that all intakes share.
  void go_to(const Position& next) noexcept {
    frames_ = next.frame - 1;
    samples_ = next.sample - 1;
    next_item_ = next.item;
  }

  // A event of the reader, between two chunks. It takes a number only when there was room, so it
  // may be tried again until there is. `name`: of the calibration that the event is about.
  [[nodiscard]] bool report(std::uint8_t event, std::uint64_t ticket,
                            std::string_view name = {}) noexcept;

  // Sink, for the decoder.
  void frame(Frame& frame) noexcept override;
  void sample(Sample& sample) noexcept override;
  void outcome(Outcome outcome) noexcept override { out_.outcome(outcome); }

 private:
  // The item takes its number, whether there is room for it or not.
  void put() noexcept;

  std::uint32_t stream_;
  std::uint64_t& next_item_;
  IntakeOut& out_;
  DeviceClock clock_;
  std::uint64_t jumps_told_ = 0;  // of the device's clock
  std::int64_t arrival_ns_ = 0;
  std::uint64_t frames_ = 0;   // sequence of the last frame
  std::uint64_t samples_ = 0;  // sequence of the last sample
  Item item_;                  // kept here because it is large
};

}  // namespace posed::pipeline
