// InformationForm: what sensors and models state about each channel, frame by frame, as precision
// and precision times mean; the input of the trajectory solvers (models/trajectory/README.md,
// "Information form" and "Pentadiagonal solve"). A frame is six rows of one value per channel: for
// each window (position; delta [-1/2 0 1/2]; delta-delta [1 -2 1], both centred on the frame) the
// precision p and the precision-weighted mean p mu. Information from several sources adds: a
// measured value y with variance R is p += 1/R, p mu += y/R in the position's rows; no information
// is two zeros. Frames with the same information may share its memory, because solvers take one
// pointer per frame.
//
// Any unit of angle works (posed uses radians); time is counted in frames.
#pragma once

#include <hwy/aligned_allocator.h>

#include "proto/frame/rt_safe.hpp"

namespace posed::trajectory {

inline constexpr int kLanes = 8;  // rows are padded to this many doubles, one cache line
[[nodiscard]] constexpr int padded(int channels) noexcept {
  return (channels + kLanes - 1) / kLanes * kLanes;
}

// `count` rows of padded(channels) doubles, not initialised, 64-byte aligned.
using Rows = hwy::AlignedFreeUniquePtr<double[]>;
[[nodiscard]] inline Rows make_rows(int count, int stride) {
  return hwy::AllocateAligned<double>(static_cast<std::size_t>(count) *
                                      static_cast<std::size_t>(stride));
}

enum Row : int {
  kPosition,      // precision of the position
  kPositionMean,  // precision times mean
  kDelta,
  kDeltaMean,
  kDeltaDelta,
  kDeltaDeltaMean
};
inline constexpr int kRows = 6;

// The rows of consecutive frames, initially zero. The position precision of the padding is 1, so
// that the padded columns can be solved, too.
class InformationForm {
 public:
  InformationForm(int channels, int frames);

  // [channels()], 64-byte aligned.
  RT_SAFE [[nodiscard]] double* row(int frame, Row row) noexcept {
    return data_.get() + (static_cast<std::ptrdiff_t>(frame) * kRows + row) * stride_;
  }
  [[nodiscard]] const double* row(int frame, Row row) const noexcept {
    return data_.get() + (static_cast<std::ptrdiff_t>(frame) * kRows + row) * stride_;
  }
  // The frame's six rows, as solvers take them.
  [[nodiscard]] const double* frame(int frame) const noexcept { return row(frame, kPosition); }

  // Sets the frame's information to zero.
  RT_SAFE void clear(int frame) noexcept;

  [[nodiscard]] int channels() const noexcept { return channels_; }
  [[nodiscard]] int frames() const noexcept { return frames_; }
  [[nodiscard]] int stride() const noexcept { return stride_; }  // doubles from row to row

 private:
  int channels_, frames_, stride_;
  hwy::AlignedFreeUniquePtr<double[]> data_;
};

}  // namespace posed::trajectory
