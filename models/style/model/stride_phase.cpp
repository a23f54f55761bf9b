#include "models/style/model/stride_phase.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "models/style/model/harmonics.hpp"
#include "proto/frame/median.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFullTurn = 2.0 * std::numbers::pi;
constexpr int kCadences = 40;          // candidates, 2.7 % apart
constexpr double kWindow = 1.5;        // strides of the candidate that its window holds
constexpr double kHop_s = 0.1;         // between windows
constexpr int kMaxSteps = 2;           // of cadence from one window to the next
constexpr double kStepCost = 0.02;     // of one such step
constexpr double kMismatchCost = 0.5;  // of phases that do not follow from one another
constexpr double kMinAdvance = 0.5;    // of the slowest cadence's
constexpr double kQuiet = 0.05;        // of the signal's variance: a quieter window says little

// What counts as striding.
constexpr double kSwingWindow = 1.25;  // strides that the local swing is of
constexpr double kMinSwing = 0.6;    // of the clip's median swing: standing and starting have less
constexpr double kEnd_s = 0.33;      // left out at either end,
constexpr double kShortEnd_s = 0.1;  // of clips of
constexpr double kShort_s = 2.2;     // no more than this

// Least squares of [1, 3 harmonics] of one cadence on a window with Hann weights.
struct Candidate {
  double dtheta = 0.0;
  VectorXd weights;
  MatrixXd basis, solver;  // [window x 7], [7 x window]

  Candidate(double cadence, int window)
      : dtheta(cadence), weights(window), basis(window, 2 * kStrideHarmonics + 1) {
    const VectorXd t = VectorXd::LinSpaced(window, -0.5 * (window - 1), 0.5 * (window - 1));
    weights = 0.5 + 0.5 * (kFullTurn / (window + 1) * t.array()).cos();
    basis = harmonic_basis(dtheta * t, kStrideHarmonics);
    const MatrixXd weighted = basis.transpose() * weights.asDiagonal();
    MatrixXd gram = weighted * basis;
    gram.diagonal().array() += 1e-9 * weights.sum();
    solver = gram.llt().solve(weighted);
  }
};

struct LocalFit {
  double cost, phase;  // phase at the window's place
};

LocalFit fit_at(const VectorXd& signal, Eigen::Index place, const Candidate& c, double quiet) {
  const Eigen::Index window = c.weights.size();
  const Eigen::Index begin =
      std::clamp<Eigen::Index>(place - window / 2, 0, signal.size() - window);
  const auto seen = signal.segment(begin, window);
  const VectorXd fitted = c.solver * seen;
  const double floor = quiet * c.weights.sum();
  const double mean = c.weights.dot(seen) / c.weights.sum();
  const double power = c.weights.dot((seen.array() - mean).square().matrix()) + floor;
  const double left = c.weights.dot((seen - c.basis * fitted).cwiseAbs2()) + floor;
  const double offset = static_cast<double>(place - begin) - 0.5 * static_cast<double>(window - 1);
  return {left / power + weak_first_penalty(fitted),
          std::atan2(-fitted[1 + kStrideHarmonics], fitted[1]) + c.dtheta * offset};
}

// Fits of all candidates at all places, and the cheapest chain of candidates through them.
class Chain {
 public:
  Chain(std::vector<Candidate> candidates, const VectorXd& signal, Eigen::Index hop)
      : candidates_(std::move(candidates)), hop_(hop) {
    const double variance = (signal.array() - signal.mean()).square().mean();
    const double quiet = std::max(kQuiet * variance, 1e-300);
    for (Eigen::Index place = 0; place < signal.size(); place += hop) {
      auto& fits = fits_.emplace_back();
      for (const Candidate& c : candidates_) fits.push_back(fit_at(signal, place, c, quiet));
    }
  }

  // The phase at each place, unwrapped and increasing.
  [[nodiscard]] std::vector<double> phases() const {
    const std::vector<int> chosen = cheapest();
    // Where the legs show no stride the fits' phases may stand still or go back.
    const double least = kMinAdvance * candidates_.back().dtheta * static_cast<double>(hop_);
    std::vector<double> phase{fits_[0][at(chosen[0])].phase};
    for (std::size_t k = 1; k < fits_.size(); ++k) {
      const double expected = advance(chosen[k - 1], chosen[k]);
      const double measured = fits_[k][at(chosen[k])].phase - phase.back();
      const double turned = expected + std::remainder(measured - expected, kFullTurn);
      phase.push_back(phase.back() + std::max(turned, least));
    }
    return phase;
  }

 private:
  static std::size_t at(int i) { return i; }

  [[nodiscard]] double advance(int from, int to) const {
    return 0.5 * static_cast<double>(hop_) *
           (candidates_[at(from)].dtheta + candidates_[at(to)].dtheta);
  }

  [[nodiscard]] double step_cost(std::size_t place, int from, int to) const {
    const double turned = fits_[place][at(to)].phase - fits_[place - 1][at(from)].phase;
    return kStepCost * (to - from) * (to - from) +
           kMismatchCost * (1.0 - std::cos(turned - advance(from, to)));
  }

  [[nodiscard]] std::vector<int> cheapest() const {
    const int count = static_cast<int>(std::ssize(candidates_));
    std::vector<std::vector<int>> came_from;
    std::vector<double> cost(at(count));
    for (int c = 0; c < count; ++c) cost[at(c)] = fits_[0][at(c)].cost;
    for (std::size_t k = 1; k < fits_.size(); ++k) {
      std::vector<double> next(at(count), std::numeric_limits<double>::infinity());
      auto& origin = came_from.emplace_back(at(count), 0);
      for (int to = 0; to < count; ++to) {
        const int last = std::min(count - 1, to + kMaxSteps);
        for (int from = std::max(0, to - kMaxSteps); from <= last; ++from) {
          const double sum = cost[at(from)] + step_cost(k, from, to);
          if (sum < next[at(to)]) {
            next[at(to)] = sum;
            origin[at(to)] = from;
          }
        }
        next[at(to)] += fits_[k][at(to)].cost;
      }
      cost = std::move(next);
    }
    std::vector<int> chosen(fits_.size());
    chosen.back() = static_cast<int>(std::ranges::min_element(cost) - cost.begin());
    for (std::size_t k = fits_.size() - 1; k > 0; --k) {
      chosen[k - 1] = came_from[k - 1][at(chosen[k])];
    }
    return chosen;
  }

  std::vector<Candidate> candidates_;
  Eigen::Index hop_;
  std::vector<std::vector<LocalFit>> fits_;  // by place, then candidate
};

std::vector<Candidate> candidates_for(Eigen::Index frames, double rate_hz) {
  const double shortest = kMinStride_s * rate_hz;
  const double longest = std::min(kMaxStride_s * rate_hz, static_cast<double>(frames));
  std::vector<Candidate> candidates;
  for (int i = 0; i < kCadences; ++i) {
    const double period = shortest * std::pow(longest / shortest, i / (kCadences - 1.0));
    const auto window = static_cast<Eigen::Index>(std::lround(kWindow * period));
    candidates.emplace_back(kFullTurn / period, static_cast<int>(std::min(window, frames)));
  }
  return candidates;
}

// Linear between the places, and beyond the last one.
VectorXd between(const std::vector<double>& at_places, Eigen::Index hop, Eigen::Index frames,
                 double dtheta) {
  VectorXd phase(frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const std::size_t k = t / hop;
    const auto beyond = static_cast<double>(t % hop);
    const double rate = k + 1 < at_places.size()
                            ? (at_places[k + 1] - at_places[k]) / static_cast<double>(hop)
                            : dtheta;
    phase[t] = at_places[k] + beyond * rate;
  }
  return phase;
}

// How far the legs swing about each frame: the first harmonic's amplitude in a fit with the local
// mean, under Hann weights.
VectorXd local_swing(const VectorXd& signal, const VectorXd& phase, Eigen::Index half) {
  VectorXd swing(signal.size());
  for (Eigen::Index t = 0; t < signal.size(); ++t) {
    const Eigen::Index first = std::max<Eigen::Index>(0, t - half);
    const Eigen::Index count = std::min(signal.size(), t + half + 1) - first;
    const VectorXd offset = VectorXd::LinSpaced(count, static_cast<double>(first - t),
                                                static_cast<double>(first + count - 1 - t));
    const VectorXd weights =
        0.5 + 0.5 * (0.5 * kFullTurn / static_cast<double>(half + 1) * offset.array()).cos();
    const MatrixXd basis = harmonic_basis(phase.segment(first, count), 1);
    const MatrixXd weighted = basis.transpose() * weights.asDiagonal();
    MatrixXd gram = weighted * basis;
    gram.diagonal().array() += 1e-2 / 3.0 * gram.trace();  // of a window that is mostly outside
    const VectorXd fitted = gram.llt().solve(weighted * signal.segment(first, count));
    swing[t] = std::hypot(fitted[1], fitted[2]);
  }
  return swing;
}

double median_of(const VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  return median(sorted);
}

std::vector<Eigen::Index> striding_frames(const VectorXd& signal, const StridePhase& found,
                                          double rate_hz) {
  const Eigen::Index frames = signal.size();
  const double stride = kFullTurn / found.dtheta;
  const VectorXd centred = signal.array() - median_of(signal);
  const VectorXd swing = local_swing(
      centred, found.phase, std::max<Eigen::Index>(1, std::lround(0.5 * kSwingWindow * stride)));
  const double least = kMinSwing * median_of(swing);
  const bool is_short = static_cast<double>(frames) <= kShort_s * rate_hz;
  const auto end = static_cast<Eigen::Index>((is_short ? kShortEnd_s : kEnd_s) * rate_hz);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index t = end; t < frames - end; ++t) {
    if (swing[t] > least) kept.push_back(t);
  }
  if (static_cast<double>(kept.size()) >= stride) return kept;
  kept.resize(static_cast<std::size_t>(frames));
  std::iota(kept.begin(), kept.end(), Eigen::Index{0});
  return kept;
}

// The mean over neighbours that both stride.
double cadence_of(const StridePhase& found) {
  double turned = 0.0;
  int steps = 0;
  for (std::size_t i = 1; i < found.strides.size(); ++i) {
    if (found.strides[i] != found.strides[i - 1] + 1) continue;
    turned += found.phase[found.strides[i]] - found.phase[found.strides[i - 1]];
    ++steps;
  }
  return steps > 0 ? turned / steps : found.dtheta;
}

}  // namespace

StridePhase follow_strides(const VectorXd& signal, double rate_hz) {
  const Eigen::Index frames = signal.size();
  assert(has_stride(static_cast<int>(frames), rate_hz));
  const auto hop = std::max<Eigen::Index>(1, std::lround(kHop_s * rate_hz));
  const Chain chain(candidates_for(frames, rate_hz), signal, hop);
  const std::vector<double> places = chain.phases();
  const auto spanned = static_cast<double>(hop) * static_cast<double>(places.size() - 1);
  StridePhase found;
  found.dtheta = (places.back() - places.front()) / std::max(spanned, 1.0);
  found.phase = between(places, hop, frames, found.dtheta);
  const VectorXd centred = signal.array() - signal.mean();
  const MatrixXd basis = harmonic_basis(found.phase, kStrideHarmonics);
  const VectorXd fitted = fit_harmonics(found.phase, centred, kStrideHarmonics);
  found.score = (centred - basis * fitted).squaredNorm() / std::max(centred.squaredNorm(), 1e-300) +
                weak_first_penalty(fitted);
  found.strides = striding_frames(signal, found, rate_hz);
  found.dtheta = cadence_of(found);
  return found;
}

std::optional<WalkPhases> walk_phases(const Eigen::VectorXd& signal, double rate_hz) {
  if (!has_stride(static_cast<int>(signal.size()), rate_hz)) return std::nullopt;
  StridePhase strides = follow_strides(signal, rate_hz);
  WalkPhases walk{.frames = std::move(strides.strides), .phase = {}};
  walk.phase = strides.phase(walk.frames);
  const double turned_rad = static_cast<double>(walk.phase.size()) * strides.dtheta;
  if (turned_rad < kFullTurn) return std::nullopt;
  walk.phase.array() -= first_harmonic_phase(walk.phase, signal(walk.frames));
  return walk;
}

}  // namespace posed::style
