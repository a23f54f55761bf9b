#include "models/motion/synthetic_round.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace posed::motion {
namespace {

constexpr int kPlaces = 4096;
constexpr double kStands = 1.5;  // strides from the last step's place to the first step
constexpr double kRamp = 0.9;    // strides in which he comes to his pace or to rest
constexpr double kRest = 0.85;   // the middle of standing, a share of half a round
// The turn, shares of half a round; it is wide, because a style sees a walker from a heading that
// follows him within a second.
constexpr double kTurnFrom = 0.02, kTurnTo = 0.7, kTurnEase = 0.15;

// Like smooth_step, but quick at first: the first step is a third of a stride already.
double setting_off(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (6.0 - 8.0 * x + 3.0 * x * x);
}

// 0 outside of the turn, 1 within.
double turning(double share) {
  const double u = (share - kTurnFrom) / (kTurnTo - kTurnFrom);
  return smooth_step(std::min(u, 1.0 - u) / kTurnEase);
}

}  // namespace

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

Round::Round(double stride_m, double strides, double over)
    : half_(0.5 * strides),
      rest_(over + 0.5 * kStands + 0.5 * std::floor(2.0 * (kRest * half_ - over) - kStands)),
      places_(kPlaces + 1) {
  const double step = half_ / kPlaces;
  for (int i = 0; i < kPlaces; ++i) {
    const double stride = (i + 0.5) * step;
    const double turn = turn_rad_per_stride(stride) * step, ahead = stride_m * pace(stride) * step;
    const Place& from = places_[i];
    const double heading = from.heading_rad + 0.5 * turn;
    places_[i + 1] = {.x_m = from.x_m + ahead * std::sin(heading),
                      .z_m = from.z_m + ahead * std::cos(heading),
                      .heading_rad = from.heading_rad + turn};
  }
}

double Round::in_half(double stride) const { return stride - half_ * std::floor(stride / half_); }

Round::Place Round::place(double in_half) const {
  const double at = in_half / half_ * kPlaces;
  const int before = std::min(static_cast<int>(at), kPlaces - 1);
  const double share = at - before;
  const Place &a = places_[before], &b = places_[before + 1];
  return {.x_m = a.x_m + share * (b.x_m - a.x_m),
          .z_m = a.z_m + share * (b.z_m - a.z_m),
          .heading_rad = a.heading_rad + share * (b.heading_rad - a.heading_rad)};
}

// The second half is the first one, begun where that ends and turned by half a turn.
Eigen::Vector3d Round::at_m(double stride) const {
  const Place here = place(in_half(stride));
  const Eigen::Vector3d at(here.x_m, 0.0, here.z_m);
  const bool second = std::fmod(std::floor(stride / half_), 2.0) != 0.0;
  return second ? Eigen::Vector3d(places_.back().x_m, 0.0, places_.back().z_m) - at : at;
}

double Round::heading_rad(double stride) const {
  return std::numbers::pi * std::floor(stride / half_) + place(in_half(stride)).heading_rad;
}

double Round::from_rest(double stride) const {
  return std::abs(std::remainder(stride - rest_, half_));
}

double Round::pace(double stride) const {
  return setting_off((from_rest(stride) - 0.5 * kStands) / kRamp);
}

// The body sways before the first step's foot leaves the floor, and until the last one has landed.
double Round::swing(double stride) const {
  return smooth_step(from_rest(stride) - 0.5 * kStands + 0.4);
}

double Round::turn_rad_per_stride(double stride) const {
  const double least = (kTurnTo - kTurnFrom) * (1.0 - kTurnEase) * half_;
  return std::numbers::pi / least * turning(in_half(stride) / half_);
}

}  // namespace posed::motion
