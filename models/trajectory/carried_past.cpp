#include "models/trajectory/carried_past.hpp"

#include <utility>

namespace posed::trajectory {

CarriedPast::CarriedPast(int stride)
    : now_(make_rows(kernel::kCarryRows, stride)), next_(make_rows(kernel::kCarryRows, stride)) {}

RT_SAFE void CarriedPast::begin(long first) noexcept {
  if (first == first_) return;
  first_ = first;
  from_ = kNone;
  if (left_ != first) return;
  std::swap(now_, next_);
  from_ = std::exchange(left_, kNone);
}

RT_SAFE Carry CarriedPast::incoming() const noexcept {
  return {.in = from_ == kNone ? nullptr : now_.get(), .out = nullptr};
}

RT_SAFE Carry CarriedPast::incoming_and_outgoing() noexcept {
  left_ = first_ + 1;
  return {.in = incoming().in, .out = next_.get()};
}

RT_SAFE void CarriedPast::forget() noexcept { first_ = from_ = left_ = kNone; }

}  // namespace posed::trajectory
