#include "models/smooth/hmm_forward_filter.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

using gesture::kDeltaWindows;
using gesture::kStates;

constexpr double kTemper = 0.05;  // exponent of the likelihoods at the model's rate
// A hand may begin a gesture at any time; this probability keeps the filter from locking up.
const double kLogRestart = std::log(1e-4);
// The same for what is none of the labels.
constexpr double kLost = 1e-4;
const double kLogLost = std::log(kLost);
// By how much, at the model's rate, a frame is more probable as none of the labels (as a logarithm)
// where the pose is twice as far as a label's limit; less while the hand moves this fast.
constexpr double kSure = 2.0;
constexpr double kMoving = 0.25;
constexpr double kSlow_rad_s = 40.0 * kDegree;  // rms over the channels that move
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr double kMinStay_frames = 1.5;  // frames
constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kVanished = 1e-200;
// Variance that sensor noise adds to a feature, relative to the noise variance of a value.
constexpr std::array<double, kDeltaWindows> kNoiseGain{1.0, 0.5, 6.0};
// The same for a source's errors: they last, and so much of their variance is new in each frame.
constexpr double kNewError = 0.1;

std::size_t padded_features(int channels) noexcept {
  return trajectory::padded(kDeltaWindows * channels);
}

// ln(e^a + e^b)
double log_sum(double a, double b) noexcept {
  const double top = std::max(a, b);
  if (top == -std::numeric_limits<double>::infinity()) return top;
  return top + std::log1p(std::exp(std::min(a, b) - top));
}

}  // namespace

HmmForwardFilter::HmmForwardFilter(int max_window, int max_channels, double error_rad)
    : max_window_(max_window),
      error_rad_(error_rad),
      feature_(padded_features(max_channels)),
      weight_(feature_.size()),
      known_(max_channels, kMissing),
      tables_(kMaxLiveChains * kStates + 1),
      rows_(tables_.size() * kTableRows * feature_.size()),
      forward_(max_window),
      likelihood_(max_window),
      swept_(max_window) {
  for (auto& row : past_) row.resize(max_channels);
}

RT_SAFE void HmmForwardFilter::set_model(const LiveModel* model) noexcept {
  model_ = model;
  states_ = model == nullptr ? 0 : static_cast<int>(model->states.size());
  features_ = model == nullptr ? 0 : padded_features(model->channels);
  period_s_ = 0.0;
  reset();
}

RT_SAFE void HmmForwardFilter::reset() noexcept {
  pushed_ = 0;
  swept_frames_ = 0;
  even_frames_ = 0;
  for (auto& row : past_) std::ranges::fill(row, kMissing);
  std::ranges::fill(known_, kMissing);
  if (states_ == 0) return;
  std::fill_n(log_now_.begin(), all(), -std::log(static_cast<double>(all())));
  const auto labels = static_cast<double>(model_->labels.size());
  const bool pairs = model_->chains.front().previous != kAny;
  log_choices_ = std::log(pairs ? labels - 1.0 : labels);
  log_chains_ = std::log(static_cast<double>(model_->chains.size()));
}

RT_SAFE double HmmForwardFilter::added_variance(std::size_t window) const noexcept {
  const double lasting = window == 0 ? 1.0 : kNewError;
  return kNoiseGain[window] * (noise_rad_ * noise_rad_ + lasting * error_rad_ * error_rad_);
}

// Recomputes a state's Gaussian for this stream's rate and sensor noise.
RT_SAFE void HmmForwardFilter::renew_table(std::size_t s) noexcept {
  const LiveState& from = state(s);
  Table& table = tables_[s];
  const RateFactors rule = rate_factors(pace_);
  const std::size_t channels = model_->channels;
  double* const mean = features_of(s, kMean);
  double* const half_precision = features_of(s, kHalfPrecision);
  double* const half_log = features_of(s, kHalfLog);
  std::size_t k = 0;
  for (std::size_t w = 0; w < kDeltaWindows; ++w) {
    const double added = added_variance(w);
    for (std::size_t c = 0; c < channels; ++c, ++k) {
      const double variance = from.variance[k] * rule.variance[w] + added;
      mean[k] = from.mean[k] * rule.mean[w];
      half_precision[k] = 0.5 / variance;
      half_log[k] = 0.5 * std::log(variance);
    }
  }
  for (; k < features_; ++k) mean[k] = half_precision[k] = half_log[k] = 0.0;
  table.stay = 1.0 - 1.0 / std::max(kMinStay_frames, from.frames * pace_);
  table.log_stay = std::log(table.stay);
  table.log_leave = std::log(1.0 - table.stay);
}

RT_SAFE void HmmForwardFilter::push(std::span<const double> measured_rad, bool even,
                                    double period_s, double noise_rad) noexcept {
  if (model_ == nullptr) return;
  const bool first = period_s_ <= 0.0;
  period_s_ = period_s > 0.0 ? period_s : 1.0 / model_->rate_hz;
  noise_rad_ = noise_rad;
  pace_ = std::max(1.0 / (period_s_ * model_->rate_hz), 0.1);
  // Period and noise change slowly, so updating one state per frame is enough.
  for (std::size_t i = 0; i < (first ? all() : 1); ++i) {
    renew_table(next_table_);
    next_table_ = (next_table_ + 1) % all();
  }
  even_frames_ = even ? std::min(even_frames_ + 1, 2) : 0;
  Row log_emission;
  if (model_->held) measure_held();
  const bool by_poses = model_->held && error_rad_ > 0.0;
  if (by_poses) {
    weigh_held(log_emission);
  } else {
    weigh(measured_rad, log_emission);
  }
  if (model_->held && model_->none) {
    const auto states = log_emission.begin() + states_;
    *states = *std::max_element(log_emission.begin(), states) + none_margin(measured_rad);
  }
  for (std::size_t c = 0; c < measured_rad.size(); ++c) {
    past_[1][c] = past_[0][c];
    past_[0][c] = measured_rad[c];
    if (std::isfinite(measured_rad[c])) known_[c] = measured_rad[c];
  }
  advance(log_emission);
}

// The tempered log likelihood of every state; missing values are left out.
RT_SAFE void HmmForwardFilter::weigh(std::span<const double> measured_rad, Row& out) noexcept {
  const std::size_t channels = model_->channels;
  std::fill_n(feature_.begin(), features_, 0.0);
  std::fill_n(weight_.begin(), features_, 0.0);
  const bool near = even_frames_ == 2;
  for (std::size_t c = 0; c < channels; ++c) {
    if (model_->moves[c] == 0) continue;
    const double before = past_[0][c];
    const double now = near ? measured_rad[c] : kMissing;
    const std::array<double, kDeltaWindows> values{before, 0.5 * (now - past_[1][c]),
                                                   now - 2.0 * before + past_[1][c]};
    for (std::size_t w = 0; w < kDeltaWindows; ++w) {
      if (!std::isfinite(values[w])) continue;
      feature_[w * channels + c] = values[w];
      weight_[w * channels + c] = kTemper / pace_;
    }
  }
  for (std::size_t s = 0; s < all(); ++s) {
    const double* const mean = features_of(s, kMean);
    const double* const half_precision = features_of(s, kHalfPrecision);
    const double* const half_log = features_of(s, kHalfLog);
    std::array<double, trajectory::kLanes>
        sum{};  // several sums, because each addition waits for the previous one
    for (std::size_t k = 0; k < features_; k += trajectory::kLanes) {
      for (std::size_t i = 0; i < trajectory::kLanes; ++i) {
        const double off = feature_[k + i] - mean[k + i];
        sum[i] += weight_[k + i] * (off * off * half_precision[k + i] + half_log[k + i]);
      }
    }
    out[s] = -std::accumulate(sum.begin(), sum.end(), 0.0);
  }
}

// Errors of one joint go with those of others, which only the spread of the held poses knows; and
// they jump, so that steps tell nothing.
RT_SAFE void HmmForwardFilter::weigh_held(Row& out) const noexcept {
  for (std::size_t s = 0; s < static_cast<std::size_t>(states_); ++s) {
    const double off = off_held_[static_cast<std::size_t>(model_->chains[s / kStates].label)];
    out[s] = std::isfinite(off) ? -0.5 * kTemper / pace_ * off : 0.0;
  }
}

RT_SAFE void HmmForwardFilter::measure_held() noexcept {
  const LiveHeld& held = *model_->held;
  const std::size_t channels = model_->channels;
  std::fill_n(off_held_.begin(), held.limit.size(), 0.0);
  const double* weight = held.whitening.data();
  for (std::size_t row = 0; row < channels; ++row) {
    double value = 0.0;
    for (std::size_t c = 0; c <= row; ++c) value += *weight++ * known_[held.channel[c]];
    for (std::size_t l = 0; l < held.limit.size(); ++l) {
      const double off = value - held.mean[l * channels + row];
      off_held_[l] += off * off;
    }
  }
}

RT_SAFE double HmmForwardFilter::off_labels() const noexcept {
  const LiveHeld& held = *model_->held;
  const double noise = held.noise_gain * added_variance(0);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t l = 0; l < held.limit.size(); ++l) {
    nearest = std::min(nearest, (off_held_[l] - noise) / held.limit[l]);
  }
  return std::isfinite(nearest) ? std::max(nearest, 0.0) : kMissing;
}

// On the way from pose to pose a hand is far from all of them; what it was before counts then.
RT_SAFE double HmmForwardFilter::none_margin(std::span<const double> measured_rad) noexcept {
  const double off = off_labels();
  double sum = 0.0, count = 0.0;
  for (std::size_t c = 0; c < measured_rad.size(); ++c) {
    const double step = 0.5 * (measured_rad[c] - past_[1][c]);
    if (model_->moves[c] == 0 || !std::isfinite(step)) continue;
    sum += step * step;
    ++count;
  }
  const double noise = added_variance(1);
  const double speed2 = std::max(sum / std::max(count, 1.0) - noise, 0.0) / (period_s_ * period_s_);
  const double still = 1.0 / (1.0 + speed2 / (kSlow_rad_s * kSlow_rad_s));
  if (std::isnan(off)) return 0.0;
  const double sure = off > 1.0 ? still * std::min(off - 1.0, 1.0) - (1.0 - still) * kMoving
                                : std::max(2.0 * (off - 1.0), -1.0);
  return kSure / pace_ * sure;
}

// One step of the forward filter.
RT_SAFE void HmmForwardFilter::advance(const Row& log_emission) noexcept {
  const std::size_t states = states_;
  LabelRow leaving;  // log probability of leaving each label's last states
  std::fill_n(leaving.begin(), model_->labels.size(), kNever);
  double leaving_any = kNever;
  for (std::size_t s = kStates - 1; s < states; s += kStates) {
    const auto label = static_cast<std::size_t>(model_->chains[s / kStates].label);
    const double leaves = log_now_[s] + tables_[s].log_leave;
    leaving[label] = log_sum(leaving[label], leaves);
    leaving_any = log_sum(leaving_any, leaves);
  }
  Row next;
  double top = kNever;
  for (std::size_t s = 0; s < states; ++s) {
    const int previous = model_->chains[s / kStates].previous;
    double entering = log_now_[s > 0 ? s - 1 : 0] + tables_[s > 0 ? s - 1 : 0].log_leave;
    if (s % kStates == 0) {
      entering = (previous == kAny ? leaving_any : leaving[previous]) - log_choices_;
      entering = log_sum(entering, kLogRestart);
      if (model_->none) {
        entering = log_sum(entering, log_now_[states] + tables_[states].log_leave - log_chains_);
      }
    }
    next[s] = log_sum(log_now_[s] + tables_[s].log_stay, entering) + log_emission[s];
    top = std::max(top, next[s]);
  }
  if (model_->none) {
    next[states] =
        log_sum(log_now_[states] + tables_[states].log_stay, kLogLost) + log_emission[states];
    top = std::max(top, next[states]);
  }
  double sum = 0.0;
  for (std::size_t s = 0; s < all(); ++s) sum += std::exp(next[s] - top);
  const double norm = top + std::log(sum);
  const double best = *std::max_element(log_emission.begin(),
                                        log_emission.begin() + static_cast<std::ptrdiff_t>(all()));
  const std::size_t at = pushed_ % max_window_;
  for (std::size_t s = 0; s < all(); ++s) {
    log_now_[s] = next[s] - norm;
    forward_[at][s] = std::exp(log_now_[s]);
    likelihood_[at][s] = std::exp(log_emission[s] - best);
  }
  ++pushed_;
}

// Backward recursion from the newest frame. State probabilities are computed in the linear domain;
// a frame for which all products vanish keeps its forward probabilities.
RT_SAFE void HmmForwardFilter::sweep(int frames) noexcept {
  if (model_ == nullptr) return;
  const std::size_t states = all();
  Row backward;
  std::fill_n(backward.begin(), states, 1.0);
  swept_frames_ = static_cast<int>(std::min<long>(frames, pushed_));
  for (int back = 0; back < swept_frames_; ++back) {
    const std::size_t at = (pushed_ - 1 - back) % max_window_;
    Row& belief = swept_[back];
    double sum = 0.0;
    for (std::size_t s = 0; s < states; ++s) {
      belief[s] = forward_[at][s] * backward[s];
      sum += belief[s];
    }
    const bool kept = sum > kVanished;
    for (std::size_t s = 0; s < states; ++s) belief[s] = kept ? belief[s] / sum : forward_[at][s];
    Row ahead;
    for (std::size_t s = 0; s < states; ++s) {
      ahead[s] = (kept ? backward[s] : 1.0) * likelihood_[at][s];
    }
    step_back(ahead, backward);
  }
}

// One backward step, from a frame to the one before it; scaled so that the largest is 1.
RT_SAFE void HmmForwardFilter::step_back(const Row& ahead, Row& backward) const noexcept {
  const std::size_t states = states_;
  const double choice = std::exp(-log_choices_);
  LabelRow entries;  // of the first states of the chains that follow a label
  std::fill_n(entries.begin(), model_->labels.size(), 0.0);
  double entries_any = 0.0;
  for (std::size_t s = 0; s < states; s += kStates) {
    const int previous = model_->chains[s / kStates].previous;
    if (previous != kAny) entries[previous] += choice * ahead[s];
    if (previous == kAny) entries_any += choice * ahead[s];
  }
  double largest = kVanished;
  double firsts = 0.0;  // of the first states of all chains
  for (std::size_t s = 0; s < states; ++s) {
    const auto label = static_cast<std::size_t>(model_->chains[s / kStates].label);
    const bool last = s % kStates == kStates - 1;
    const double onwards = last ? entries[label] + entries_any : ahead[s + 1];
    backward[s] = tables_[s].stay * ahead[s] + (1.0 - tables_[s].stay) * onwards;
    if (model_->none) backward[s] += kLost * ahead[states];
    if (s % kStates == 0) firsts += ahead[s];
    largest = std::max(largest, backward[s]);
  }
  if (model_->none) {
    const double chains = static_cast<double>(model_->chains.size());
    const double stay = tables_[states].stay;
    backward[states] = stay * ahead[states] + (1.0 - stay) * firsts / chains;
    largest = std::max(largest, backward[states]);
  }
  for (std::size_t s = 0; s < all(); ++s) backward[s] /= largest;
}

// The features taken at a frame describe the frame before it, so frame `back` uses the
// probabilities of one step later in time.
RT_SAFE std::span<const double> HmmForwardFilter::states(int back) const noexcept {
  assert(knows(back));
  return {swept_[std::max(0, back - 1)].data(), static_cast<std::size_t>(states_)};
}

RT_SAFE double HmmForwardFilter::none(int back) const noexcept {
  if (!model_->none) return 0.0;
  return swept_[std::max(0, back - 1)][states_];
}

RT_SAFE HmmForwardFilter::Answer HmmForwardFilter::label(int back) const noexcept {
  Answer answer;
  if (!knows(back)) return answer;
  const auto belief = states(back);
  LabelRow probability;
  std::fill_n(probability.begin(), model_->labels.size(), 0.0);
  for (std::size_t s = 0; s < belief.size(); ++s) {
    probability[static_cast<std::size_t>(model_->chains[s / kStates].label)] += belief[s];
  }
  for (std::size_t l = 0; l < model_->labels.size(); ++l) {
    if (probability[l] > answer.probability) answer = {static_cast<int>(l), probability[l]};
  }
  if (none(back) > answer.probability) answer = {kNone, none(back)};
  return answer;
}

}  // namespace posed::smooth
