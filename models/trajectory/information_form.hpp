// InformationForm: what is known of a hand's channels, frame by frame, in the form in which
// trajectories are solved (models/trajectory/README.md, "Information form" and "Pentadiagonal
// solve"). A frame is six rows of one value a channel: for each window (position; delta [-1/2 0
// 1/2]; curve [1 -2 1], both centred on the frame) the precision p and the precision-weighted mean
// p mu. InformationForm from several sources adds: a measured value y with variance R is p += 1/R,
// p mu += y/R on the position's rows; no evidence is two zeros. Frames that share their evidence
// share its memory: solvers take one pointer a frame.
//
// Any unit of angle serves (the product's is the radian), time is counted in frames.
#pragma once

#include <hwy/aligned_allocator.h>

namespace posed::trajectory {

inline constexpr int kLanes = 8;  // rows are padded to this many doubles, one cache line
[[nodiscard]] constexpr int padded(int channels) noexcept {
  return (channels + kLanes - 1) / kLanes * kLanes;
}

enum Row : int {
  kPosition,      // precision of the position
  kPositionMean,  // precision times mean
  kDelta,
  kDeltaMean,
  kCurve,
  kCurveMean
};
inline constexpr int kRows = 6;

// Frames of evidence side by side, zero at first; the padding's position has precision 1, so that
// every column of a system can be solved.
class InformationForm {
 public:
  InformationForm(int channels, int frames);

  // [channels()], 64-byte aligned. RT-safe.
  [[nodiscard]] double* row(int frame, Row row) noexcept {
    return data_.get() + (static_cast<std::ptrdiff_t>(frame) * kRows + row) * stride_;
  }
  [[nodiscard]] const double* row(int frame, Row row) const noexcept {
    return data_.get() + (static_cast<std::ptrdiff_t>(frame) * kRows + row) * stride_;
  }
  // What solvers take: the frame's six rows.
  [[nodiscard]] const double* frame(int frame) const noexcept { return row(frame, kPosition); }

  // Forgets what is known of the frame. RT-safe.
  void clear(int frame) noexcept;

  [[nodiscard]] int channels() const noexcept { return channels_; }
  [[nodiscard]] int frames() const noexcept { return frames_; }
  [[nodiscard]] int stride() const noexcept { return stride_; }  // doubles from row to row

 private:
  int channels_, frames_, stride_;
  hwy::AlignedFreeUniquePtr<double[]> data_;
};

}  // namespace posed::trajectory
