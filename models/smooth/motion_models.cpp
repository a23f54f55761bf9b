#include "models/smooth/motion_models.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kDegrees2 = kDegree * kDegree;  // [rad^2]

// The constants of models/smooth/README.md, "Bank of motion models". White noise of the
// acceleration [rad^2/s^3] or of its change [rad^2/s^5].
struct Assumed {
  double acceleration, jerk;
};
constexpr std::array<Assumed, 7> kAssumed{{{4e6 * kDegrees2, 0.0},
                                           {0.0, 1e5 * kDegrees2},
                                           {0.0, 6e5 * kDegrees2},
                                           {0.0, 4e6 * kDegrees2},
                                           {0.0, 2.5e7 * kDegrees2},
                                           {0.0, 1.6e8 * kDegrees2},
                                           {0.0, 1e9 * kDegrees2}}};
constexpr double kModelsFirstSpeed2 = 1e4 * kDegrees2;   // variance [rad^2/s^2]
constexpr double kFirstAcceleration2 = 1e6 * kDegrees2;  // [rad^2/s^4]
constexpr double kErrorMemory_s = 5.0;                   // of the errors
constexpr double kHandEvidenceShare = 0.5;  // of the hand's mean in a channel's evidence
constexpr double kSettled_s = 1.0;          // before a channel's evidence is believed
constexpr double kMinError2 = 1e-9;         // over the variance of the noise
constexpr double kMaxError2 = 25.0;         // over the variance of the noise
constexpr double kMinUnexplained = 1e-4;  // share of a measurement that an estimate does not follow
constexpr long kTurns = 8;  // frames between two weighings of a channel, as weights change slowly

}  // namespace

RT_SAFE void MotionModels::Spread::start(double variance_rad2) noexcept {
  *this = {};
  state[0][0] = variance_rad2;
  state[1][1] = kModelsFirstSpeed2;
  state[2][2] = kFirstAcceleration2;
  variance.fill(variance_rad2);
}

RT_SAFE void MotionModels::Spread::predict(double step_s, std::size_t model) noexcept {
  static_assert(kAssumed.size() == kModels);
  const double h = step_s;
  const auto move = [h](std::array<double, 3>& row) {
    row[0] += h * row[1] + 0.5 * h * h * row[2];
    row[1] += h * row[2];
  };
  for (std::size_t i = past.size() - 1; i > 0; --i) {
    past[i] = past[i - 1];
    variance[i] = variance[i - 1];
  }
  past[1] = state[0];
  variance[1] = state[0][0];
  for (std::size_t i = 1; i < past.size(); ++i) move(past[i]);
  for (auto& row : state) move(row);  // P F'
  for (std::size_t j = 0; j < 3; ++j) {
    state[0][j] += h * state[1][j] + 0.5 * h * h * state[2][j];
    state[1][j] += h * state[2][j];
  }
  const auto [a, q] = kAssumed[model];
  const double h2 = h * h;
  const double h3 = h2 * h;
  state[0][0] += a * h3 / 3.0 + q * h2 * h3 / 20.0;
  state[1][1] += a * h + q * h3 / 3.0;
  state[2][2] += q * h;
  const double xv = 0.5 * a * h2 + q * h2 * h2 / 8.0;
  state[0][1] += xv;
  state[1][0] += xv;
  state[0][2] += q * h3 / 6.0;
  state[2][0] += q * h3 / 6.0;
  state[1][2] += 0.5 * q * h2;
  state[2][1] += 0.5 * q * h2;
}

RT_SAFE std::array<double, 3 + MotionModels::kPositions> MotionModels::Spread::update(
    double variance_rad2) noexcept {
  const double precision = 1.0 / (state[0][0] + variance_rad2);
  const std::array<double, 3> row = state[0];
  std::array<double, 3 + kPositions> gains{};
  for (std::size_t i = 0; i < 3; ++i) gains[i] = precision * row[i];
  gains[3] = gains[0];
  for (std::size_t i = 1; i < past.size(); ++i) {
    const double gain = precision * past[i][0];
    gains[3 + i] = gain;
    variance[i] -= gain * past[i][0];
    for (std::size_t j = 0; j < 3; ++j) past[i][j] -= gain * row[j];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) state[i][j] -= gains[i] * row[j];
  }
  return gains;
}

MotionModels::MotionModels(int channels) : channels_(channels) { reset(); }

RT_SAFE void MotionModels::reset() noexcept {
  pushed_ = 0;
  std::ranges::fill(channels_, Channel());
  for (Channel& channel : channels_) {
    channel.error2.fill(1.0);
    channel.weight[kModels] = 1.0;
  }
}

RT_SAFE void MotionModels::restart(std::size_t channel, double value_rad) noexcept {
  Channel& at = channels_[channel];
  at.known_s = 0.0;
  for (auto& positions : at.position) positions.fill(value_rad);
  at.motion = {};
  at.error2.fill(1.0);
  at.weight.fill(0.0);
  at.weight[kModels] = 1.0;
}

RT_SAFE void MotionModels::push(double step_s, std::span<const double> measured_rad,
                                double noise_rad, std::span<const double> share) noexcept {
  noise_before_rad2_ = noise_rad2_;
  noise_rad2_ = noise_rad * noise_rad;
  step_s_ = step_s;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    channels_[c].before_rad = std::exchange(channels_[c].now_rad, measured_rad[c]);
    channels_[c].share_before = std::exchange(channels_[c].share, share.empty() ? 1.0 : share[c]);
  }
  for (std::size_t m = 0; m < kModels; ++m) {
    if (pushed_ == 0) {
      spread_[m].start(noise_rad2_);
      continue;
    }
    spread_[m].predict(step_s, m);
    const auto gains = spread_[m].update(noise_rad2_);
    for (Channel& channel : channels_) {
      auto& position = channel.position[m];
      auto& [speed, acceleration] = channel.motion[m];
      for (std::size_t i = position.size() - 1; i > 0; --i) position[i] = position[i - 1];
      position[0] += step_s * speed + 0.5 * step_s * step_s * acceleration;
      speed += step_s * acceleration;
      const double off = channel.now_rad - position[0];
      for (std::size_t i = 0; i < position.size(); ++i) position[i] += gains[3 + i] * off;
      speed += gains[1] * off;
      acceleration += gains[2] * off;
    }
  }
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    channels_[c].known_s += step_s;
    const bool follows = std::isfinite(measured_rad[c]) && std::isfinite(channels_[c].before_rad);
    if (!follows || pushed_ == 0) {
      restart(c, std::isfinite(measured_rad[c]) ? measured_rad[c] : 0.0);
    }
  }
  ++pushed_;
}

// A measurement that an estimate follows with the share h lies (1 - h) of its distance from the
// estimate that does without it.
RT_SAFE void MotionModels::judge(const double* window_rad, const double* window_rad2) noexcept {
  if (pushed_ < 2) return;
  std::array<double, kModels> unexplained{};
  const double precision = 1.0 / noise_before_rad2_;
  for (std::size_t m = 0; m < kModels; ++m) {
    unexplained[m] = std::max(kMinUnexplained, 1.0 - spread_[m].variance[1] * precision);
  }
  const double fresh = 1.0 - std::exp(-step_s_ / kErrorMemory_s);
  std::array<double, kModels + 1> hand{};
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    Channel& channel = channels_[c];
    if (channel.known_s == 0.0) continue;
    const double own = precision / (channel.share_before * channel.share_before);
    const auto learn = [&](std::size_t m, double estimate_rad, double share) {
      const double off = (channel.before_rad - estimate_rad) / share;
      channel.error2[m] += fresh * (std::min(off * off * own, kMaxError2) - channel.error2[m]);
      hand[m] += channel.error2[m];
    };
    for (std::size_t m = 0; m < kModels; ++m) learn(m, channel.position[m][1], unexplained[m]);
    learn(kModels, window_rad[c], std::max(kMinUnexplained, 1.0 - window_rad2[c] * own));
  }
  for (double& error2 : hand) error2 = std::log(std::max(error2, kMinError2));
  for (auto c = static_cast<std::size_t>(pushed_ % kTurns); c < channels_.size(); c += kTurns) {
    weigh(c, hand);
  }
}

RT_SAFE void MotionModels::weigh(std::size_t channel,
                                 const std::array<double, kModels + 1>& hand) noexcept {
  Channel& at = channels_[channel];
  if (at.known_s < kSettled_s) return;
  const double frames = kErrorMemory_s / step_s_;
  std::array<double, kModels + 1> evidence{};
  for (std::size_t m = 0; m <= kModels; ++m) {
    const double own = std::log(std::max(at.error2[m], kMinError2));
    evidence[m] = -0.5 * frames * ((1.0 - kHandEvidenceShare) * own + kHandEvidenceShare * hand[m]);
  }
  const double most = std::ranges::max(evidence);
  double sum = 0.0;
  for (std::size_t m = 0; m <= kModels; ++m) {
    at.weight[m] = std::exp(evidence[m] - most);
    sum += at.weight[m];
  }
  for (double& weight : at.weight) weight /= sum;
}

RT_SAFE double MotionModels::mixed(int channel, int back, double window_rad) const noexcept {
  const Channel& at = channels_[static_cast<std::size_t>(channel)];
  double made = at.weight[kModels] * window_rad;
  for (std::size_t m = 0; m < kModels; ++m) {
    made += at.weight[m] * at.position[m][static_cast<std::size_t>(back)];
  }
  return made;
}

}  // namespace posed::smooth
