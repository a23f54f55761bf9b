#include "models/smooth/steady_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kFirstSpeed2 = 1e4 * kDegree * kDegree;  // variance [rad^2/s^2]
constexpr double kMinProbability = 0.05;                  // so that neither model is ever ruled out
constexpr double kMaxEvidence = 30.0;  // largest log likelihood ratio that a frame may add

// The Gaussian with the mean and covariance of the mixture of both.
RT_SAFE ConstantVelocity mixed(const ConstantVelocity& a, double share, const ConstantVelocity& b) {
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

RT_SAFE void ConstantVelocity::predict(double step_s, double density) noexcept {
  const double step2 = step_s * step_s;
  x += step_s * v;
  xx += 2.0 * step_s * xv + step2 * vv + density * step2 * step_s / 3.0;
  xv += step_s * vv + 0.5 * density * step2;
  vv += density * step_s;
}

RT_SAFE ConstantVelocity::Innovation ConstantVelocity::update(double measured_rad,
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

RT_SAFE void InteractingModels::start(double measured_rad, double variance_rad2) noexcept {
  loose_ = {.x = measured_rad, .xx = variance_rad2, .vv = kFirstSpeed2};
  tight_ = loose_;
  loose_probability_ = 0.5;
  started_ = true;
}

// The motion may change its kind between two frames: each model goes on from the mixture of both
// states that may have led to it.
RT_SAFE void InteractingModels::predict(double step_s, const Stay& stay,
                                        const Density& density) noexcept {
  assert(started_);
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

RT_SAFE double InteractingModels::surprise(double measured_rad, double variance_rad2) noexcept {
  assert(started_);
  const auto loose = loose_.update(measured_rad, variance_rad2);
  const auto tight = tight_.update(measured_rad, variance_rad2);
  return 0.5 * (tight.distance2 - loose.distance2 + std::log(tight.variance / loose.variance));
}

RT_SAFE void InteractingModels::weigh(double log_loose_over_tight) noexcept {
  const double ratio = std::exp(std::clamp(log_loose_over_tight, -kMaxEvidence, kMaxEvidence));
  const double loose = loose_probability_ * ratio;
  loose_probability_ = std::clamp(loose / (loose + 1.0 - loose_probability_), kMinProbability,
                                  1.0 - kMinProbability);
}

namespace {

// The constants of models/smooth/README.md, "Steady motion".
constexpr double kSteadyDensity = 0.004 * kDegree * kDegree;  // [rad^2/s^3]
constexpr double kSteadyFor_s = 3.7;     // mean time that a steady motion lasts
constexpr double kUnsteadyFor_s = 17.0;  // and the time between two of them
constexpr double kHandEvidence = 2.5;  // weight of the hand's mean beside a channel's own evidence
constexpr double kUnnoticed_s = 0.17;  // after which a change of the motion is noticed at last

}  // namespace

const double SteadyMotion::kDensityRoot = std::sqrt(std::sqrt(kSteadyDensity));

SteadyMotion::SteadyMotion(int channels, int stride, int frames)
    : stride_(stride),
      frames_(frames),
      models_(channels),
      evidence_(channels),
      time_s_(frames),
      loose_(trajectory::make_rows(frames, stride)) {
  reset();
}

RT_SAFE void SteadyMotion::reset() noexcept {
  pushed_ = 0;
  std::ranges::fill(models_, InteractingModels());
  std::fill_n(loose_.get(), static_cast<std::ptrdiff_t>(frames_) * stride_, 1.0);
}

RT_SAFE void SteadyMotion::push(double time_s, std::span<const double> measured_rad,
                                const Channels& known) noexcept {
  const std::size_t before = (pushed_ + frames_ - 1) % frames_;
  follow(pushed_ > 0 ? time_s - time_s_[before] : 0.0, measured_rad, known);
  remember(time_s, measured_rad);
  ++pushed_;
}

// Channels of a hand begin and end their motions together, so the mean of their evidence counts
// for each of them.
RT_SAFE void SteadyMotion::follow(double step_s, std::span<const double> measured_rad,
                                  const Channels& known) noexcept {
  const InteractingModels::Stay stay{.loose = std::exp(-step_s / kUnsteadyFor_s),
                                     .tight = std::exp(-step_s / kSteadyFor_s)};
  const auto is_new = [&](std::size_t c) {
    return std::isfinite(measured_rad[c]) && !known.repeated &&
           (known.again.empty() || known.again[c] == 0);
  };
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    InteractingModels& model = models_[c];
    const bool measured = is_new(c);
    evidence_[c] = 0.0;
    if (model.started()) {
      model.predict(step_s, stay, {.loose = known.density[c], .tight = kSteadyDensity});
      if (!measured) continue;
      evidence_[c] = model.surprise(measured_rad[c], known.variance_rad2[c]);
      sum += known.active[c] * evidence_[c];
      count += known.active[c];
    } else if (measured) {
      model.start(measured_rad[c], known.variance_rad2[c]);
    }
  }
  const double hand = count > 0.0 ? kHandEvidence * sum / count : 0.0;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    if (is_new(c)) models_[c].weigh(evidence_[c] + hand);
  }
}

// A change of the motion shows in the measurements some frames after it began, so the frames
// before are at least as loose. A missing value is bridged as the speed-adaptive prior does it.
RT_SAFE void SteadyMotion::remember(double time_s, std::span<const double> measured_rad) noexcept {
  double* const newest = row(pushed_);
  time_s_[pushed_ % frames_] = time_s;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    newest[c] = std::isfinite(measured_rad[c]) ? models_[c].loose() : 1.0;
  }
  const long first = std::max<long>(0, pushed_ + 1 - frames_);
  for (long i = pushed_ - 1; i >= first; --i) {
    if (time_s_[i % frames_] < time_s - kUnnoticed_s) break;
    double* const earlier = row(i);
    for (std::size_t c = 0; c < models_.size(); ++c) {
      earlier[c] = std::max(earlier[c], models_[c].loose());
    }
  }
}

}  // namespace posed::smooth
