// What the trainer would make of a take that was recorded live, while whoever performed it still
// stands there and can do it again. Cold.
#pragma once

#include <string>

#include "models/style/train/dataset.hpp"

namespace posed::style {

// Strides that a take must show.
inline constexpr int kMinTakeStrides = 4;

struct TakeCheck {
  double seconds = 0.0;     // of the take
  int strides = 0;          // that would be learnt from
  double standing_s = 0.0;  // that would be left out, because the legs do not stride
  std::string incomplete;   // joints with missing values, in words; empty: none
  std::string feet;         // that slide or stand unevenly, in words; empty: they are good
  std::string problem;      // why nothing can be learnt from it, and what to do; empty: it serves

  [[nodiscard]] bool good() const { return problem.empty(); }
  // "17 strides in 20.0 s; 1.2 s of standing are left out", or the problem.
  [[nodiscard]] std::string sentence() const;
};

// Checks a walk. Values that are missing in few frames (clip::FramesClip makes them NaN) get those
// before them, and the rate becomes that of the clip's times, as training needs it. `rate_hz`: of
// the training; `silent_s`: the longest time without a frame before the first and behind the last.
[[nodiscard]] TakeCheck check_take(TrainingClip& take, double rate_hz, double silent_s = 0.0);

}  // namespace posed::style
