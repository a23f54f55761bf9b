#include "models/style/live/style_estimate.hpp"

#include <limits>

#include "proto/frame/rt_safe.hpp"

namespace posed::style {
namespace {

constexpr double kLastSecond_s = 1.0;
constexpr double kMinPart_s = 1.0 / 48.0;  // so that all of them fit
constexpr double kMinKnown_s = 0.5;

}  // namespace

RT_SAFE void StyleEstimate::update(double place, double dt_s) noexcept {
  const auto at = [&](std::size_t i) -> Part& { return parts_[(oldest_ + i) % parts_.size()]; };
  if (count_ == 0 || at(count_ - 1).time_s >= kMinPart_s) at(count_++) = {};
  for (Part* const part : {&at(count_ - 1), &all_}) {
    part->sum_s += place * dt_s;
    part->time_s += dt_s;
  }
  if (count_ < 2 || all_.time_s - parts_[oldest_].time_s < kLastSecond_s) return;
  oldest_ = (oldest_ + 1) % parts_.size();
  --count_;
  all_ = {};  // anew, so that no rounding stays
  for (std::size_t i = 0; i < count_; ++i) {
    all_.sum_s += at(i).sum_s;
    all_.time_s += at(i).time_s;
  }
}

double StyleEstimate::value() const noexcept {
  if (all_.time_s < kMinKnown_s) return std::numeric_limits<double>::quiet_NaN();
  return all_.sum_s / all_.time_s;
}

}  // namespace posed::style
