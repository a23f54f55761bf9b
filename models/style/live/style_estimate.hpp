// StyleEstimate: how much of a model's style a walker shows already, from the mean pose of the last
// second (README.md, "Auto-alpha"). RT-safe.
#pragma once

#include <array>
#include <cstddef>

namespace posed::style {

class StyleEstimate {
 public:
  // Adds a pose that stood for `dt_s`; `place` is its place on the model's style axis.
  void update(double place, double dt_s) noexcept;
  void forget() noexcept { *this = {}; }

  // The mean place of the last second: 0 none of the style, 1 all of it, and beyond either, for it
  // is not clamped. NaN until half a second is known.
  [[nodiscard]] double value() const noexcept;

 private:
  struct Part {
    double sum_s = 0.0, time_s = 0.0;
  };
  // The parts of the last second, in a ring; each holds whole frames, so that slow streams have a
  // second, too.
  std::array<Part, 64> parts_{};
  std::size_t oldest_ = 0, count_ = 0;
  Part all_;
};

}  // namespace posed::style
