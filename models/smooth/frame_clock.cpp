#include "models/smooth/frame_clock.hpp"

#include <algorithm>
#include <utility>

namespace posed::smooth {
namespace {

constexpr double kShortestPeriod_s = 1e-3;  // 1000 Hz
constexpr double kLongestPeriod_s = 0.2;    // a slower step is a gap
constexpr double kFirstPeriod_s = 1.0 / 60.0;
constexpr double kShortestStep = 0.5;  // of the period
constexpr double kArrivalGain = 0.1;   // share of the lateness that corrects a step
constexpr double kGap = 1.5;           // periods: a step at least this long is a gap, not jitter

}  // namespace

// RT-safe.
double FrameClock::tick(const Header& header) noexcept {
  const bool device_time = header.device_ns != kNoTime_ns;
  const std::int64_t time_ns = device_time ? header.device_ns : header.arrival_ns;
  const bool first = !std::exchange(started_, true);
  const bool known = time_ns != kNoTime_ns && last_ns_ != kNoTime_ns &&
                     device_time == device_time_ && time_ns > last_ns_;
  const double beat_s = period_s_ > 0.0 ? period_s_ : kFirstPeriod_s;
  double step_s = beat_s;
  if (known) {
    // Unsigned: the difference of two times may exceed the signed range.
    step_s = static_cast<double>(static_cast<std::uint64_t>(time_ns) -
                                 static_cast<std::uint64_t>(last_ns_)) *
             1e-9;
    learn(step_s);
  }
  last_ns_ = time_ns;
  device_time_ = device_time;
  if (first) return now_s_;
  if (!device_time && settled()) {
    late_s_ += step_s - beat_s;
    if (late_s_ > (kGap - 1.0) * beat_s) {
      step_s = beat_s + late_s_;
      late_s_ = 0.0;
    } else {
      step_s = beat_s + kArrivalGain * late_s_;
      late_s_ -= kArrivalGain * late_s_;
    }
  }
  now_s_ += std::max(step_s, kShortestStep * beat_s);
  return now_s_;
}

// RT-safe.
void FrameClock::learn(double step_s) noexcept {
  if (step_s > kLongestPeriod_s) return;
  recent_s_[static_cast<std::size_t>(steps_ % kRecent)] = std::max(step_s, kShortestPeriod_s);
  ++steps_;
  std::array<double, kRecent> sorted = recent_s_;
  const auto end = sorted.begin() + std::min(steps_, kRecent);
  const auto middle = sorted.begin() + (end - sorted.begin()) / 2;
  std::nth_element(sorted.begin(), middle, end);
  period_s_ = *middle;
}

}  // namespace posed::smooth
