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

// The mean squared speed s between two rows of `sum`, mixed with the hand's mean.
struct Speed {
  double per_s;  // 1 / time between the two rows, times the share of the channel's own speed
  double hand;   // the hand's mean squared speed, times the share of the hand
};
// Both base + slope * s.
struct Spread {
  double delta_base, delta_slope;      // variance of the delta window
  double density_base, density_slope;  // of the acceleration
  double delta_delta_s3;               // variance of the delta-delta window for a density of 1
};
// Where the motion is steady (SteadyMotion), the density becomes
// (loose density^(1/4) + (1 - loose) root)^4 and the delta's precision is multiplied by loose.
struct Steady {
  const double* loose;  // [stride] 0 to 1
  double root;          // the steady motion's density^(1/4)
};
// Rows of one frame.
struct Prior {
  double *delta, *delta_delta;  // precisions; the means are zero
  double* density;              // as expected of the speed alone
};
void set_precision(const double* sum_from, const double* sum_to, int stride, const Speed& speed,
                   const Spread& spread, const Steady& steady, const Prior& out) noexcept;

}  // namespace posed::smooth::kernel
