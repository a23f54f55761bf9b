#include "models/style/model/stride_phase.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
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
constexpr double kStands = 0.4;        // of the largest swings: less than this is standing
constexpr double kLargest = 0.95;      // the quantile of the swings that is one of the largest
constexpr double kMinSwing = 0.6;      // of the median of what does not stand: starting has less
constexpr double kEdge_s = 0.1;        // left out at either end of a walk,
constexpr double kEnd_s = 0.33;        // and this of a recording, unless it has
constexpr double kShort_s = 2.2;       // no more than this
constexpr double kMinTold = 2.0;       // strides: fewer do not tell how well strides fit

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

// Neighbouring frames, first to end.
struct Bout {
  Eigen::Index first, end;

  [[nodiscard]] Eigen::Index frames() const { return end - first; }
};

// Where the legs swing as in a stride. However long they stand beside, it is the walk that says how
// far that is.
std::vector<Bout> bouts_of(const VectorXd& signal, const StridePhase& found) {
  const double stride = kFullTurn / found.dtheta;
  const VectorXd centred = signal.array() - median(VectorXd(signal));
  const VectorXd swing = local_swing(
      centred, found.phase, std::max<Eigen::Index>(1, std::lround(0.5 * kSwingWindow * stride)));
  const double stands = kStands * quantile(VectorXd(swing), kLargest);
  std::vector<double> walks;
  std::ranges::copy_if(swing, std::back_inserter(walks), [&](double s) { return s >= stands; });
  const double least = kMinSwing * median(walks);
  std::vector<Bout> bouts;
  for (Eigen::Index t = 0; t < swing.size(); ++t) {
    if (!(swing[t] > least)) continue;
    if (bouts.empty() || bouts.back().end != t) bouts.push_back({t, t});
    ++bouts.back().end;
  }
  return bouts;
}

// Without what begins and ends a walk, and what begins and ends the recording of `frames`.
void keep_inner(const Bout& bout, Eigen::Index frames, double rate_hz,
                std::vector<Eigen::Index>& kept) {
  const bool is_short = static_cast<double>(frames) <= kShort_s * rate_hz;
  const auto edge = static_cast<Eigen::Index>(kEdge_s * rate_hz);
  const auto end = is_short ? edge : static_cast<Eigen::Index>(kEnd_s * rate_hz);
  const Eigen::Index last = std::min(bout.end - edge, frames - end);
  for (Eigen::Index t = std::max(bout.first + edge, end); t < last; ++t) kept.push_back(t);
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

// Phases of all frames, whether they stride or not, and their mean cadence.
StridePhase follow(const VectorXd& signal, double rate_hz) {
  const auto hop = std::max<Eigen::Index>(1, std::lround(kHop_s * rate_hz));
  const Chain chain(candidates_for(signal.size(), rate_hz), signal, hop);
  const std::vector<double> places = chain.phases();
  const auto spanned = static_cast<double>(hop) * static_cast<double>(places.size() - 1);
  StridePhase found;
  found.dtheta = (places.back() - places.front()) / std::max(spanned, 1.0);
  found.phase = between(places, hop, signal.size(), found.dtheta);
  return found;
}

// Each walk between two stands is followed on its own, because beside one a window sees both. The
// phase of what stands joins theirs. Bouts of less than a stride are taken away.
void follow_apart(const VectorXd& signal, double rate_hz, StridePhase& found,
                  std::vector<Bout>& bouts) {
  std::erase_if(bouts, [&](const Bout& bout) {
    return !has_stride(static_cast<int>(bout.frames()), rate_hz);
  });
  std::vector<Bout> walks;
  Eigen::Index known = 0;  // frames whose phase is the final one
  for (const Bout& bout : bouts) {
    const StridePhase own = follow(signal.segment(bout.first, bout.frames()), rate_hz);
    const VectorXd& phase = own.phase;
    if (phase[phase.size() - 1] - phase[0] < kFullTurn) continue;
    const Eigen::Index gap = bout.first - known;
    double start = phase[0];
    if (known > 0) {
      const double before = found.phase[known - 1];
      const double least = before + kMinAdvance * own.dtheta;
      start += kFullTurn * std::ceil((least - start) / kFullTurn);
      const double step = (start - before) / static_cast<double>(gap + 1);
      for (Eigen::Index i = 0; i < gap; ++i) {
        found.phase[known + i] = before + step * static_cast<double>(i + 1);
      }
    } else {
      for (Eigen::Index i = 0; i < gap; ++i) {
        found.phase[i] = start - own.dtheta * static_cast<double>(gap - i);
      }
    }
    found.phase.segment(bout.first, bout.frames()) = phase.array() + (start - phase[0]);
    known = bout.end;
    walks.push_back(bout);
    found.dtheta = own.dtheta;
  }
  for (Eigen::Index t = known; known > 0 && t < signal.size(); ++t) {
    found.phase[t] = found.phase[t - 1] + found.dtheta;
  }
  bouts = std::move(walks);
}

std::vector<Eigen::Index> frames_of(const std::vector<Bout>& bouts) {
  std::vector<Eigen::Index> frames;
  for (const Bout& bout : bouts) {
    for (Eigen::Index t = bout.first; t < bout.end; ++t) frames.push_back(t);
  }
  return frames;
}

double score_of(const VectorXd& signal, const VectorXd& phase) {
  const VectorXd centred = signal.array() - signal.mean();
  const MatrixXd basis = harmonic_basis(phase, kStrideHarmonics);
  const VectorXd fitted = fit_harmonics(phase, centred, kStrideHarmonics);
  return (centred - basis * fitted).squaredNorm() / std::max(centred.squaredNorm(), 1e-300) +
         weak_first_penalty(fitted);
}

}  // namespace

StridePhase follow_strides(const VectorXd& signal, double rate_hz) {
  const Eigen::Index frames = signal.size();
  assert(has_stride(static_cast<int>(frames), rate_hz));
  StridePhase found = follow(signal, rate_hz);
  std::vector<Bout> bouts = bouts_of(signal, found);
  const bool all_stride = bouts.size() == 1 && bouts.front().frames() == frames;
  if (!all_stride) {
    follow_apart(signal, rate_hz, found, bouts);
    // Now that their cadence is known, their ends are seen where they are.
    if (!bouts.empty()) bouts = bouts_of(signal, found);
    follow_apart(signal, rate_hz, found, bouts);
  }
  for (const Bout& bout : bouts) keep_inner(bout, frames, rate_hz, found.strides);
  if (static_cast<double>(found.strides.size()) * found.dtheta < kFullTurn) {
    found.strides.resize(static_cast<std::size_t>(frames));
    std::iota(found.strides.begin(), found.strides.end(), Eigen::Index{0});
  }
  const std::vector<Eigen::Index> walked = frames_of(bouts);
  const bool told = static_cast<double>(walked.size()) * found.dtheta >= kMinTold * kFullTurn;
  found.score =
      told ? score_of(signal(walked), found.phase(walked)) : score_of(signal, found.phase);
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
