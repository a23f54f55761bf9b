#include "models/smooth/unwrap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "proto/frame/rotation.hpp"

namespace posed::smooth {
namespace {

constexpr double kPi = std::numbers::pi;

double distance_rad(const std::array<double, 3>& a, const double* b) noexcept {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

std::array<double, 3> nearest(std::array<double, 3> angles, const double* last) noexcept {
  for (std::size_t i = 0; i < 3; ++i) angles[i] = unwrap_near(angles[i], last[i]);
  return angles;
}

// RT-safe.
void unwrap_joint(double* values, const double* last) noexcept {
  const auto same = nearest({values[0], values[1], values[2]}, last);
  const auto other = nearest({values[0] + kPi, kPi - values[1], values[2] + kPi}, last);
  std::ranges::copy(distance_rad(other, last) < distance_rad(same, last) ? other : same, values);
}

bool all_finite(const double* values) noexcept {
  return std::isfinite(values[0]) && std::isfinite(values[1]) && std::isfinite(values[2]);
}

}  // namespace

Unwrap::Unwrap(const Skeleton& skeleton) {
  int joint = -1;
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    if (channel.joint != joint) joint_channels_.push_back(0);
    joint = channel.joint;
    ++joint_channels_.back();
    last_rad_.push_back(0.0);
  }
  reset();
}

// RT-safe.
void Unwrap::reset() noexcept {
  std::ranges::fill(last_rad_, std::numeric_limits<double>::quiet_NaN());
}

// RT-safe.
void Unwrap::apply(std::span<double> values_rad) noexcept {
  double* values = values_rad.data();
  double* last = last_rad_.data();
  for (const int count : joint_channels_) {
    if (count == 3 && all_finite(values) && all_finite(last)) {
      unwrap_joint(values, last);
    } else {
      for (int i = 0; i < count; ++i) {
        if (!std::isnan(last[i])) values[i] = unwrap_near(values[i], last[i]);
      }
    }
    for (int i = 0; i < count; ++i) {
      if (std::isfinite(values[i])) last[i] = values[i];
    }
    values += count;
    last += count;
  }
}

}  // namespace posed::smooth
