#include "models/smooth/interacting_models.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kFirstSpeed2 = 1e4 * kDegree * kDegree;  // variance [rad^2/s^2]
constexpr double kLeastProbability = 0.05;                // so that neither model is ever ruled out
constexpr double kMostEvidence = 30.0;  // largest log likelihood ratio that a frame may add

// The Gaussian with the mean and covariance of the mixture of both. RT-safe.
ConstantVelocity mixed(const ConstantVelocity& a, double share, const ConstantVelocity& b) {
  const double rest = 1.0 - share;
  const double between = share * rest;
  const double dx = a.x - b.x;
  const double dv = a.v - b.v;
  return {.x = share * a.x + rest * b.x,
          .v = share * a.v + rest * b.v,
          .xx = share * a.xx + rest * b.xx + between * dx * dx,
          .xv = share * a.xv + rest * b.xv + between * dx * dv,
          .vv = share * a.vv + rest * b.vv + between * dv * dv};
}

}  // namespace

// RT-safe.
void ConstantVelocity::predict(double step_s, double density) noexcept {
  const double step2 = step_s * step_s;
  x += step_s * v;
  xx += 2.0 * step_s * xv + step2 * vv + density * step2 * step_s / 3.0;
  xv += step_s * vv + 0.5 * density * step2;
  vv += density * step_s;
}

// RT-safe.
ConstantVelocity::Innovation ConstantVelocity::update(double measured_rad,
                                                      double variance_rad2) noexcept {
  const double variance = xx + variance_rad2;
  const double precision = 1.0 / variance;
  const double off = measured_rad - x;
  const double gain = xx * precision;
  const double speed_gain = xv * precision;
  x += gain * off;
  v += speed_gain * off;
  vv -= speed_gain * xv;
  xv -= gain * xv;
  xx -= gain * xx;
  return {.variance = variance, .distance2 = off * off * precision};
}

// RT-safe.
void InteractingModels::start(double measured_rad, double variance_rad2) noexcept {
  loose_ = {.x = measured_rad, .xx = variance_rad2, .vv = kFirstSpeed2};
  tight_ = loose_;
  loose_probability_ = 0.5;
  started_ = true;
}

// The motion may change its kind between two frames: each model goes on from the mixture of both
// states that may have led to it. RT-safe.
void InteractingModels::predict(double step_s, const Stay& stay, const Density& density) noexcept {
  const double remains = loose_probability_ * stay.loose;
  const double leaves = loose_probability_ - remains;
  const double enters = (1.0 - loose_probability_) * (1.0 - stay.tight);
  const double probability = remains + enters;
  const ConstantVelocity loose = mixed(loose_, remains / probability, tight_);
  tight_ = mixed(loose_, leaves / (1.0 - probability), tight_);
  loose_ = loose;
  loose_probability_ = probability;
  loose_.predict(step_s, density.loose);
  tight_.predict(step_s, density.tight);
}

// RT-safe.
double InteractingModels::surprise(double measured_rad, double variance_rad2) noexcept {
  const auto loose = loose_.update(measured_rad, variance_rad2);
  const auto tight = tight_.update(measured_rad, variance_rad2);
  return 0.5 * (tight.distance2 - loose.distance2 + std::log(tight.variance / loose.variance));
}

// RT-safe.
void InteractingModels::weigh(double log_loose_over_tight) noexcept {
  const double ratio = std::exp(std::clamp(log_loose_over_tight, -kMostEvidence, kMostEvidence));
  const double loose = loose_probability_ * ratio;
  loose_probability_ = std::clamp(loose / (loose + 1.0 - loose_probability_), kLeastProbability,
                                  1.0 - kLeastProbability);
}

}  // namespace posed::smooth
