// The inner loops of the speed-adaptive prior (models/smooth/README.md, "Speed-adaptive prior"),
// for all channels at once, compiled once per instruction set by Highway: how fast a window's
// trajectory moves, and the evidence that follows from it. RT-safe. Rows are [stride] doubles,
// 64-byte aligned.
#pragma once

#include <cstddef>

namespace posed::smooth::kernel {

// Squared speed summed over time: sum[i + 1] = sum[i] + (x_i - x_{i-1})^2 / step_s[i], sum[0] = 0;
// the first frame's step is the second's again. hand[i + 1]: the same, summed over the channels
// that `active` (0 or 1) counts. frames at least 2; x and sum are rows without gaps.
void sum_speeds(const double* x, int frames, int stride, const double* step_s, const double* active,
                double* sum, double* hand) noexcept;

// Precision of one frame's delta and curve (zero mean): c * (base + slope * s), s the mean of the
// squared speed between two rows of `sum`, mixed with the hand's own.
struct Spread {
  double per_s;                    // 1 / time between the two rows, times the channel's share
  double hand;                     // the hand's mean squared speed, times its share
  double delta_base, delta_slope;  // variance of the delta window, per frame
  double curve_base, curve_slope;  // of the curve window
};
void set_precision(const double* sum_from, const double* sum_to, int stride, const Spread& spread,
                   double* delta, double* curve) noexcept;

}  // namespace posed::smooth::kernel
