#include "models/trajectory/sliding_window.hpp"

#include <cassert>

namespace posed::trajectory {

SlidingWindow::SlidingWindow(int channels, int max_frames)
    : channels_(channels),
      stride_(padded(channels)),
      x_(hwy::AllocateAligned<double>(static_cast<std::size_t>(max_frames) *
                                      static_cast<std::size_t>(stride_))),
      factor_rows_(
          hwy::AllocateAligned<double>(static_cast<std::size_t>(max_frames) * kernel::kFactorRows *
                                       static_cast<std::size_t>(stride_))) {
  for (int i = 0; i < max_frames; ++i) {
    factors_.push_back(factor_rows_.get() +
                       static_cast<std::ptrdiff_t>(i) * kernel::kFactorRows * stride_);
  }
}

RT_SAFE void SlidingWindow::solve(std::span<const double* const> information, Boundary boundary,
                                  const double* skew, const Carry& carry) noexcept {
  frames_ = static_cast<int>(information.size());
  assert(frames_ >= 1 && frames_ <= static_cast<int>(factors_.size()));
  kernel::eliminate({information.data(), frames_, stride_, boundary, skew, carry.in, carry.out},
                    factors_.data());
  kernel::substitute(factors_.data(), frames_, 0, stride_, x_.get());
}

RT_SAFE void SlidingWindow::variance(int frame, double* out) const noexcept {
  kernel::variance(factors_.data(), frames_, frame, stride_, out, 0);
}

RT_SAFE void SlidingWindow::variances(double* out) const noexcept {
  kernel::variance(factors_.data(), frames_, 0, stride_, out, stride_);
}

}  // namespace posed::trajectory
