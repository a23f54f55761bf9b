// The inner loops of the speed-adaptive prior (models/smooth/README.md, "Speed-adaptive prior"),
// for all channels at once, compiled once per instruction set by Highway: the squared speed of a
// window's trajectory, and the precisions that follow from it. RT-safe. Rows are [stride] doubles,
// 64-byte aligned.
#pragma once

#include <cstddef>

namespace posed::smooth::kernel {

// Squared speed summed over time: sum[i + 1] = sum[i] + (x_i - x_{i-1})^2 / step_s[i], sum[0] = 0;
// the first frame uses the second frame's step. hand[i + 1]: the same, summed over the channels
// whose `active` is 1 (else 0). Needs at least 2 frames; rows of x and sum are contiguous.
void sum_speeds(const double* x, int frames, int stride, const double* step_s, const double* active,
                double* sum, double* hand) noexcept;

// Sets the precisions of one frame's delta and delta-delta (mean zero) to 1 / (base + slope * s),
// where s is the mean squared speed between two rows of `sum`, mixed with the hand's mean.
struct Spread {
  double per_s;  // 1 / time between the two rows, times the share of the channel's own speed
  double hand;   // the hand's mean squared speed, times the share of the hand
  double delta_base, delta_slope;              // variance of the delta window, per frame
  double delta_delta_base, delta_delta_slope;  // variance of the delta-delta window
};
void set_precision(const double* sum_from, const double* sum_to, int stride, const Spread& spread,
                   double* delta, double* curve) noexcept;

}  // namespace posed::smooth::kernel
