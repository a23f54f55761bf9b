#include "daemon/tools/report/axis.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

namespace posed::report {
namespace {

// 1, 2 or 5 times a power of ten: the largest step that gives at most `most` ticks.
double round_step(double extent, int most) {
  const double rough = extent / std::max(1, most);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string tick_text(double value) {
  const bool long_number = std::abs(value) >= 1e5 && std::abs(value) < 1e9;  // {:g}: 1e+05
  return long_number ? fmt::format("{:.0f}", value) : fmt::format("{:g}", value);
}

}  // namespace

void Range::add(double value) {
  if (!std::isfinite(value)) return;
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

Axis::Axis(std::string title, std::string unit, const Range& range)
    : title_(std::move(title)), unit_(std::move(unit)) {
  if (range.empty) return;
  low_ = range.low;
  high_ = range.high;
  if (high_ - low_ > 1e-9 * std::max(std::abs(low_), std::abs(high_))) return;
  const double room = low_ == 0.0 ? 1.0 : 0.1 * std::abs(low_);  // all values are the same
  low_ -= room;
  high_ += room;
}

Axis Axis::logarithmic(std::string title, std::string unit, const Range& range) {
  Axis axis(std::move(title), std::move(unit), {});
  axis.logarithmic_ = true;
  axis.low_ = 0.1;
  axis.high_ = 1.0;
  if (range.empty || range.high <= 0.0) return axis;
  constexpr double kMostDecades = 1e6;  // below, a value is as good as none
  const double least = std::max(range.low, range.high / kMostDecades);
  axis.low_ = std::pow(10.0, std::floor(std::log10(least)));
  axis.high_ = std::pow(10.0, std::ceil(std::log10(range.high)));
  if (axis.high_ <= axis.low_) axis.high_ = 10.0 * axis.low_;
  return axis;
}

void Axis::place(double from_px, double to_px) {
  from_px_ = from_px;
  to_px_ = to_px;
}

bool Axis::shows(double value) const {
  return std::isfinite(value) && (!logarithmic_ || value > 0.0);
}

double Axis::px(double value) const {
  const double inside = std::clamp(value, low_, high_);
  const double share = logarithmic_ ? std::log(inside / low_) / std::log(high_ / low_)
                                    : (inside - low_) / (high_ - low_);
  return from_px_ + share * (to_px_ - from_px_);
}

std::vector<Tick> Axis::ticks(int most) const {
  std::vector<Tick> ticks;
  if (logarithmic_) {
    const double decades = std::round(std::log10(high_ / low_));
    const bool halves = 2.0 * decades + 1.0 <= most;  // room for 3 between 1 and 10
    for (double decade = 0.0; decade <= decades; ++decade) {
      const double value = low_ * std::pow(10.0, decade);
      ticks.push_back({value, tick_text(value)});
      if (halves && decade < decades) ticks.push_back({3.0 * value, tick_text(3.0 * value)});
    }
    return ticks;
  }
  const double step = round_step(high_ - low_, most);
  for (double k = std::ceil(low_ / step - 1e-9); k * step <= high_ + 1e-9 * step; ++k) {
    const double value = k == 0.0 ? 0.0 : k * step;  // never -0
    ticks.push_back({value, tick_text(value)});
  }
  if (ticks.empty()) ticks.push_back({low_, tick_text(low_)});
  return ticks;
}

void equal_scales(Axis& x, double width_px, Axis& y, double height_px) {
  const double scale = std::max((x.high() - x.low()) / width_px, (y.high() - y.low()) / height_px);
  const auto widen = [&](Axis& axis, double length_px) {
    const double middle = 0.5 * (axis.low() + axis.high());
    const double half = 0.5 * scale * length_px;
    axis.widen(middle - half, middle + half);
  };
  widen(x, width_px);
  widen(y, height_px);
}

}  // namespace posed::report
