// CarriedPast: what the frames that have left a sliding window say about those still in it
// (models/trajectory/README.md, "Sliding window"). Each solve leaves what its first frame says
// about the next two; the window that begins one frame later includes it. A window that begins
// anywhere else starts from nothing.
//
// All memory is allocated at construction; the rest is RT-safe. One thread.
#pragma once

#include "models/trajectory/sliding_window.hpp"

namespace posed::trajectory {

class CarriedPast {
 public:
  explicit CarriedPast(int stride);

  // The window's next solves begin with frame number `first`.
  void begin(long first) noexcept;

  // For a solve whose result is not final, and for the window's last solve (three frames or more).
  [[nodiscard]] Carry taken() const noexcept;
  [[nodiscard]] Carry taken_and_left() noexcept;

  void forget() noexcept;

 private:
  static constexpr long kNone = -1;

  long first_ = kNone;                // of the window
  long from_ = kNone, left_ = kNone;  // first frames of the windows that the two rows are for
  Rows now_, next_;                   // [kernel::kCarryRows][stride]
};

}  // namespace posed::trajectory
