#include "models/smooth/steady_motion.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
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
      models_(static_cast<std::size_t>(channels)),
      evidence_(static_cast<std::size_t>(channels)),
      time_s_(static_cast<std::size_t>(frames)),
      loose_(trajectory::make_rows(frames, stride)) {
  reset();
}

// RT-safe.
void SteadyMotion::reset() noexcept {
  pushed_ = 0;
  std::ranges::fill(models_, InteractingModels());
  std::fill_n(loose_.get(), static_cast<std::ptrdiff_t>(frames_) * stride_, 1.0);
}

// RT-safe.
void SteadyMotion::push(double time_s, std::span<const double> measured_rad,
                        const Channels& known) noexcept {
  const auto before = static_cast<std::size_t>((pushed_ + frames_ - 1) % frames_);
  follow(pushed_ > 0 ? time_s - time_s_[before] : 0.0, measured_rad, known);
  remember(time_s, measured_rad);
  ++pushed_;
}

// Channels of a hand begin and end their motions together, so the mean of their evidence counts
// for each of them. RT-safe.
void SteadyMotion::follow(double step_s, std::span<const double> measured_rad,
                          const Channels& known) noexcept {
  const InteractingModels::Stay stay{.loose = std::exp(-step_s / kUnsteadyFor_s),
                                     .tight = std::exp(-step_s / kSteadyFor_s)};
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    InteractingModels& model = models_[c];
    const bool measured = std::isfinite(measured_rad[c]);
    evidence_[c] = 0.0;
    if (model.started()) {
      model.predict(step_s, stay, {.loose = known.density[c], .tight = kSteadyDensity});
      if (!measured) continue;
      evidence_[c] = model.surprise(measured_rad[c], known.variance_rad2);
      sum += known.active[c] * evidence_[c];
      count += known.active[c];
    } else if (measured) {
      model.start(measured_rad[c], known.variance_rad2);
    }
  }
  const double hand = count > 0.0 ? kHandEvidence * sum / count : 0.0;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    if (std::isfinite(measured_rad[c])) models_[c].weigh(evidence_[c] + hand);
  }
}

// A change of the motion shows in the measurements some frames after it began, so the frames
// before are at least as loose. A missing value is bridged as the speed-adaptive prior does it.
// RT-safe.
void SteadyMotion::remember(double time_s, std::span<const double> measured_rad) noexcept {
  double* const newest = row(pushed_);
  time_s_[static_cast<std::size_t>(pushed_ % frames_)] = time_s;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    newest[c] = std::isfinite(measured_rad[c]) ? models_[c].loose() : 1.0;
  }
  const long first = std::max<long>(0, pushed_ + 1 - frames_);
  for (long i = pushed_ - 1; i >= first; --i) {
    if (time_s_[static_cast<std::size_t>(i % frames_)] < time_s - kUnnoticed_s) break;
    double* const earlier = row(i);
    for (std::size_t c = 0; c < models_.size(); ++c) {
      earlier[c] = std::max(earlier[c], models_[c].loose());
    }
  }
}

}  // namespace posed::smooth
