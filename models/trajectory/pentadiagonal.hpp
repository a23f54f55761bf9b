// The inner loops of trajectory generation, for all channels at once, compiled once per
// instruction set by Highway. All are RT-safe.
//
// For each channel the most likely trajectory solves P x = r, P symmetric with two bands on either
// side (models/trajectory/README.md, "Pentadiagonal solve"). Frame i is eliminated into x_i = z_i -
// f1 x_{i+1} - f2 x_{i+2}, given the two frames after it, with variance v. The normal equations are
// built in registers during this pass, so a solve is one pass forward over the information and one
// back over the factors, with one division per frame and channel. Every channel has one fixed order
// of operations, so AVX2 and AVX-512 give the same bits.
//
// Rows are [stride] doubles, stride a multiple of kLanes; all pointers 64-byte aligned.
#pragma once

#include <cstdint>

namespace posed::trajectory {

// What delta and delta-delta windows use beyond the ends of the sequence
// (models/trajectory/README.md, "Boundary rules").
enum class Boundary : std::uint8_t {
  kDrop,  // such windows are left out
  kZero,  // zeros, as in equations 9 to 11 of Takamido et al.; pulls the ends towards 0
  kHold   // the edge frame, repeated
};

namespace kernel {

inline constexpr int kFactorRows = 4;  // f1, f2, z, v
// What the eliminated past states about the next two frames i and i + 1 (with windows centred up to
// frame i): d0_i, d1_i, r_i, d0_{i+1}, r_{i+1}.
inline constexpr int kCarryRows = 5;

struct System {
  const double* const* information;  // [frames], each kRows rows
  int frames;                        // at least 1
  int stride;
  Boundary boundary = Boundary::kDrop;
  // Null: frames are even. Else [frames]: k = (h2 - h1) / (h1 + h2) with the times h1 before and h2
  // after the frame; its delta-delta window is then [1 + k, -2, 1 - k].
  const double* skew = nullptr;
  // Null: the sequence begins with the first frame. Else kCarryRows rows that the frames before it
  // left; the boundary rule then applies to the end only.
  const double* carry_in = nullptr;
  // Not null: receives the carry after the first frame, which is thereby eliminated permanently.
  // Needs three frames or more; may be the same memory as carry_in.
  double* carry_out = nullptr;
};

// factors: [frames], each kFactorRows rows. A frame without any information gives NaN.
void eliminate(const System& system, double* const* factors) noexcept;

// x of the frames from the last back to `first`: x[0] is `first`, rows of [stride].
void substitute(const double* const* factors, int frames, int first, int stride,
                double* x) noexcept;

// The posterior variances, given all frames, of the frames from the last back to `first`. Each is
// written `step` doubles before its successor, so that `out` is the variance of `first` (step 0:
// only that one; step stride: rows like x).
void variance(const double* const* factors, int frames, int first, int stride, double* out,
              int step) noexcept;

}  // namespace kernel
}  // namespace posed::trajectory
