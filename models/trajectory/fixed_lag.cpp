#include "models/trajectory/fixed_lag.hpp"

#include <algorithm>
#include <cassert>

namespace posed::trajectory {

FixedLag::FixedLag(int channels, int lag)
    : lag_(lag),
      recent_(channels, kOpen),
      carry_(make_rows(kernel::kCarryRows, recent_.stride())),
      x_(make_rows(lag + 1, recent_.stride())) {
  const int kept = std::max(lag + 1, kOpen);
  factor_rows_ = make_rows(kept * kernel::kFactorRows, stride());
  for (int i = 0; i < kept; ++i) {
    factors_.push_back(factor_rows_.get() +
                       static_cast<std::ptrdiff_t>(i) * kernel::kFactorRows * stride());
  }
  for (int i = 0; i < kOpen; ++i) tail_[i] = recent_.frame(i);
}

RT_SAFE void FixedLag::push(const double* information) noexcept {
  if (pushed_ >= kOpen) std::ranges::rotate(tail_, tail_.begin() + 1);
  const long open = std::min<long>(pushed_, kOpen - 1);
  double* newest = recent_.row(static_cast<int>(pushed_ % kOpen), kPosition);
  std::copy_n(information, kRows * stride(), newest);
  tail_[open] = newest;
  if (pushed_ >= static_cast<long>(factors_.size())) {
    std::ranges::rotate(factors_, factors_.begin() + 1);
  }
  ++pushed_;
  const int frames = static_cast<int>(open) + 1;
  const auto held = std::min<long>(pushed_, static_cast<long>(factors_.size()));
  // The first of the open frames is eliminated permanently as soon as there are three.
  kernel::eliminate({.information = tail_.data(),
                     .frames = frames,
                     .stride = stride(),
                     .carry_in = pushed_ > kOpen ? carry_.get() : nullptr,
                     .carry_out = frames == kOpen ? carry_.get() : nullptr},
                    factors_.data() + held - frames);
}

RT_SAFE void FixedLag::estimate(int back, double* x, double* variance) noexcept {
  const auto held = static_cast<int>(std::min<long>(pushed_, static_cast<long>(factors_.size())));
  const int first = held - 1 - back;
  assert(back >= 0 && first >= 0);
  kernel::substitute(factors_.data(), held, first, stride(), x_.get());
  std::copy_n(x_.get(), stride(), x);
  if (variance != nullptr) {
    kernel::variance(factors_.data(), held, first, stride(), variance, 0);
  }
}

}  // namespace posed::trajectory
