// The inner loops of trajectory generation, for all channels at once, compiled once per
// instruction set by Highway. All are RT-safe.
//
// Per channel the most likely trajectory solves P x = r, P symmetric with two bands on either side
// (models/trajectory/README.md, "Pentadiagonal solve"). Frame i is eliminated into x_i = z_i - f1
// x_{i+1} - f2 x_{i+2}, given the two frames after it, with variance v. Normal equations are built
// in registers on the way, so a solve is one pass forward over the evidence and one back over the
// factors; a division a frame and channel. Every channel has one fixed order of operations, so AVX2
// and AVX-512 give the same bits.
//
// Rows are [stride] doubles, stride a multiple of kLanes; all pointers 64-byte aligned.
#pragma once

#include <cstdint>

namespace posed::trajectory {

// What windows that leave the string see there (models/trajectory/README.md, "Boundary rules").
enum class Boundary : std::uint8_t {
  kDrop,  // nothing: such windows do not count
  kZero,  // zeros, as equations 9 to 11 of Takamido et al. read: pulls the ends towards 0
  kHold   // the edge frame again
};

namespace kernel {

inline constexpr int kFactorRows = 4;  // f1, f2, z, v
// What the eliminated past says of the next two frames i and i + 1 (windows centred up to i
// counted): d0_i, d1_i, r_i, d0_{i+1}, r_{i+1}.
inline constexpr int kCarryRows = 5;

struct System {
  const double* const* evidence;  // [frames], each kRows rows
  int frames;                     // at least 1
  int stride;
  Boundary boundary = Boundary::kDrop;
  // Null: frames are even. Else [frames]: how uneven a frame stands between its neighbours, (h2 -
  // h1) / (h1 + h2) of the times before and after it; its curve window is then [1 + k, -2, 1 - k].
  const double* skew = nullptr;
  // Null: the string begins with the first frame. Else kCarryRows rows: what the frames before it
  // left; the boundary rule then holds for the end only.
  const double* carry_in = nullptr;
  // Not null: receives the carry after the first frame, which is thereby settled for good. Needs
  // three frames or more; may be carry_in.
  double* carry_out = nullptr;
};

// factors: [frames], each kFactorRows rows. A frame that nothing fixes comes out as not a number.
void eliminate(const System& system, double* const* factors) noexcept;

// x of the frames from the last back to `first`: x[0] is `first`, rows of [stride].
void substitute(const double* const* factors, int frames, int first, int stride,
                double* x) noexcept;

// The posterior variances, given the evidence of all, of the frames from the last back to `first`:
// each is written `step` doubles before the one after it, so that `out` ends as that of `first`
// (step 0: that one alone; step stride: rows like x).
void variance(const double* const* factors, int frames, int first, int stride, double* out,
              int step) noexcept;

}  // namespace kernel
}  // namespace posed::trajectory
