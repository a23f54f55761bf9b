// SlidingWindow: the most likely trajectory of all channels over some frames, and its variance, in
// one solve (models/trajectory/README.md, "Sliding window"). Nothing is kept between solves, so the
// information may change at any time; CarriedPast keeps what left the window. Used by the live
// smoother (a window that slides and is solved again) and, with many frames, for a whole label
// sequence. One thread.
#pragma once

#include <span>
#include <vector>

#include "models/trajectory/information_form.hpp"
#include "models/trajectory/pentadiagonal.hpp"

namespace posed::trajectory {

// What the frames before a window say about it (kernel::System::carry_in), and where to put what
// its first frame leaves for the window that begins one frame later (carry_out); either may be
// null.
struct Carry {
  const double* in = nullptr;
  double* out = nullptr;
};

class SlidingWindow {
 public:
  SlidingWindow(int channels, int max_frames);

  // Solves the given frames (1 to max_frames), each pointer to a frame's rows
  // (InformationForm::frame() of this many channels). `skew`: [frames] for uneven frames
  // (kernel::System::skew), else null.
  RT_SAFE void solve(std::span<const double* const> information,
                     Boundary boundary = Boundary::kDrop, const double* skew = nullptr,
                     const Carry& carry = {}) noexcept;

  // Results of the last solve. [channels], padded;
  RT_SAFE [[nodiscard]] const double* x(int frame) const noexcept {
    return x_.get() + static_cast<std::ptrdiff_t>(frame) * stride_;
  }
  void variance(int frame, double* out) const noexcept;  // out: [stride()], 64-byte aligned
  void variances(double* out) const noexcept;            // out: [frames][stride()]

  [[nodiscard]] int channels() const noexcept { return channels_; }
  [[nodiscard]] int stride() const noexcept { return stride_; }

 private:
  int channels_, stride_;
  int frames_ = 0;  // of the last solve
  hwy::AlignedFreeUniquePtr<double[]> x_, factor_rows_;
  std::vector<double*> factors_;
};

}  // namespace posed::trajectory
