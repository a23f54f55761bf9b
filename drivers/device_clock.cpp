#include "drivers/device_clock.hpp"

#include <algorithm>
#include <limits>

#include "proto/frame/device_time.hpp"

namespace posed::drivers {
namespace {

constexpr std::int64_t kBucket_ns = kNanosPerSecond / 2;
constexpr std::size_t kPointsForDrift = 8;  // with fewer points the noise exceeds a crystal's drift
constexpr double kMaxDrift = 1e-3;          // ten times the error of a cheap crystal
// A packet that arrives this much earlier than the line predicts: the device's time jumped forward.
constexpr std::int64_t kEarly_ns = 50'000'000;
// Packets that arrive this much later, for kLateFor_ns: not a delay; the device's time jumped back.
constexpr std::int64_t kLate_ns = 250'000'000;
constexpr std::int64_t kLateFor_ns = kNanosPerSecond;
constexpr std::int64_t kMaxTime_ns = std::numeric_limits<std::int64_t>::max() / 4;

bool plausible(std::int64_t time_ns) noexcept {
  return time_ns > -kMaxTime_ns && time_ns < kMaxTime_ns;
}

}  // namespace

void DeviceClock::restart() noexcept {
  const std::uint64_t jumps = jumps_;
  *this = DeviceClock();
  jumps_ = jumps;
}

ClockMapping DeviceClock::observe(std::int64_t device_ns, std::int64_t arrival_ns) noexcept {
  if (!plausible(device_ns) || !plausible(arrival_ns)) return mapping_;
  const std::int64_t delay_ns = arrival_ns - device_ns;
  if (jumped(device_ns, delay_ns)) {
    restart();
    ++jumps_;
  }
  if (open_until_ns_ == kNoTime_ns || device_ns >= open_until_ns_) {
    if (open_until_ns_ != kNoTime_ns) close_point();
    open_ = {device_ns, delay_ns};
    open_until_ns_ = device_ns + kBucket_ns;
  } else if (delay_ns < open_.delay_ns) {
    open_ = {device_ns, delay_ns};
  }
  if (count_ < kPointsForDrift) {
    // Too few points for a drift: use only the offset, which is the smallest delay so far.
    std::int64_t least_ns = open_.delay_ns;
    for (std::size_t i = 0; i < count_; ++i) least_ns = std::min(least_ns, points_[i].delay_ns);
    mapping_ = {.offset_ns = least_ns, .origin_ns = device_ns, .drift_ppm = 0.0F, .valid = true};
  }
  return mapping_;
}

bool DeviceClock::jumped(std::int64_t device_ns, std::int64_t delay_ns) noexcept {
  if (!mapping_.valid) return false;
  if (device_ns < open_.device_ns - kLate_ns) return true;
  const std::int64_t late_ns = delay_ns - (to_host_ns(mapping_, device_ns) - device_ns);
  if (late_ns < -kEarly_ns) return true;
  if (late_ns < kLate_ns) {
    late_since_ns_ = kNoTime_ns;
    return false;
  }
  if (late_since_ns_ == kNoTime_ns) late_since_ns_ = device_ns;
  return device_ns - late_since_ns_ >= kLateFor_ns;
}

void DeviceClock::close_point() noexcept {
  points_[(first_ + count_) % kPoints] = open_;
  if (count_ < kPoints) {
    ++count_;
  } else {
    first_ = (first_ + 1) % kPoints;
  }
  if (count_ >= kPointsForDrift) fit();
}

void DeviceClock::fit() noexcept {
  // Coordinates relative to the first point, so that doubles resolve single nanoseconds.
  const Point origin = points_[first_];
  struct XY {
    double x, y;
  };
  std::array<XY, kPoints> hull{};
  std::size_t size = 0;
  double mean_x = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& point = points_[(first_ + i) % kPoints];
    const XY next{static_cast<double>(point.device_ns - origin.device_ns),
                  static_cast<double>(point.delay_ns - origin.delay_ns)};
    mean_x += next.x / static_cast<double>(count_);
    while (size >= 2) {
      const XY& a = hull[size - 2];
      const XY& b = hull[size - 1];
      if ((b.x - a.x) * (next.y - a.y) > (b.y - a.y) * (next.x - a.x)) break;
      --size;
    }
    hull[size++] = next;
  }
  std::size_t edge = 1;
  while (edge + 1 < size && hull[edge].x < mean_x) ++edge;
  const XY& a = hull[edge - 1];
  const XY& b = hull[edge];
  const double slope = std::clamp((b.y - a.y) / (b.x - a.x), -kMaxDrift, kMaxDrift);
  const double offset = a.y - slope * a.x;
  mapping_ = {.offset_ns = origin.delay_ns + static_cast<std::int64_t>(offset),
              .origin_ns = origin.device_ns,
              .drift_ppm = static_cast<float>(slope * 1e6),
              .valid = true};
}

}  // namespace posed::drivers
