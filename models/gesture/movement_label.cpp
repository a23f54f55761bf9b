#include "models/gesture/movement_label.hpp"

#include <algorithm>
#include <cmath>

#include "models/gesture/gesture_model.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kAverage_s = 0.07;                // half width of the moving average
constexpr double kMinMovement_rad = 10 * kDegree;  // norm over all joints: less is no movement
constexpr double kOnsetShare = 0.1;                // of the fastest frame: here a way begins
constexpr double kBackShare = 0.5;                 // of the farthest distance: a take ends nearer
constexpr double kSteady_rad = 8 * kDegree;        // deviation over all joints: less is a tremor
constexpr std::size_t kMinCycles = 3;
constexpr int kMaxCycleRatio = 2;     // of the shortest one
constexpr double kHysteresis = 0.5;   // deviations that a cycle passes on both sides of the mean
constexpr double kWholeCycle = 0.75;  // of the mean cycle: a shorter rest belongs to the one before

VectorXd smoothed(const VectorXd& values, double rate_hz) {
  const auto half = static_cast<Index>(std::lround(kAverage_s * rate_hz));
  VectorXd smooth(values.size());
  for (Index t = 0; t < values.size(); ++t) {
    const Index from = std::max<Index>(t - half, 0);
    smooth[t] = values.segment(from, std::min(t + half + 1, values.size()) - from).mean();
  }
  return smooth;
}

// How far each frame is from the first one [rad], smoothed over time.
VectorXd distance_from_start(const Recording& recording) {
  const FeatureMatrix& angles = recording.angles_rad;
  return smoothed((angles.rowwise() - angles.row(0)).rowwise().norm(), recording.rate_hz);
}

// The frames at which the signal, of mean 0, rises through its mean between a low and a high.
std::vector<int> rises_of(const VectorXd& signal, double least) {
  std::vector<int> rises;
  bool low = false, high = true;
  for (Index t = 0; t < signal.size(); ++t) {
    if (signal[t] > least) high = true;
    if (high && signal[t] < -least) low = true;
    if (!low || signal[t] < 0.0) continue;
    rises.push_back(static_cast<int>(t));
    low = high = false;
  }
  return rises;
}

// The borders at which the hold in [up, down) is cut.
std::vector<int> cuts_of(const Recording& recording, int up, int arrived, int down) {
  const Oscillation found = oscillation_in(recording, arrived, down);
  if (!found.steady) {
    const int middle = (arrived + down) / 2;
    const bool room = middle - up >= kStates && down - middle >= kStates;
    return room ? std::vector<int>{middle} : std::vector<int>{};
  }
  std::vector<int> cuts = found.cycles;
  const double mean =
      static_cast<double>(cuts.back() - cuts.front()) / static_cast<double>(cuts.size() - 1);
  if (down - cuts.back() < kWholeCycle * mean) cuts.pop_back();
  if (cuts.front() - up < kStates) cuts.erase(cuts.begin());
  return cuts;
}

// The frame at which the way begins that crosses half of the distance at `crossing`: backwards from
// the fastest frame beside it, the last one that is slow. `sign`: 1 up, -1 down.
int onset(const VectorXd& distance, Index crossing, double sign) {
  const auto speed = [&](Index t) { return sign * (distance[t] - distance[t - 1]); };
  Index t = std::max<Index>(crossing, 1);
  while (t + 1 < distance.size() && speed(t + 1) > speed(t)) ++t;
  while (t > 1 && speed(t - 1) > speed(t)) --t;
  const double slow = kOnsetShare * speed(t);
  while (t > 1 && speed(t - 1) > slow) --t;
  return static_cast<int>(t - 1);
}

}  // namespace

Oscillation oscillation_in(const Recording& recording, int from, int to) {
  Oscillation found;
  if (to - from < kStates) return found;
  const FeatureMatrix held = recording.angles_rad.middleRows(from, to - from);
  const FeatureMatrix off = held.rowwise() - held.colwise().mean();
  const auto scatter =
      motion::symmetric_eigen(off.transpose() * off / static_cast<double>(to - from));
  VectorXd direction = scatter.vectors.rightCols<1>();
  Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;  // the same phase in every take
  VectorXd signal = smoothed(off * direction, recording.rate_hz);
  signal.array() -= signal.mean();
  found.deviation_rad = std::sqrt(signal.squaredNorm() / static_cast<double>(signal.size()));
  found.cycles = rises_of(signal, kHysteresis * found.deviation_rad);
  int shortest = to - from, longest = 0;
  for (std::size_t i = 1; i < found.cycles.size(); ++i) {
    shortest = std::min(shortest, found.cycles[i] - found.cycles[i - 1]);
    longest = std::max(longest, found.cycles[i] - found.cycles[i - 1]);
  }
  found.steady = found.deviation_rad >= kSteady_rad && found.cycles.size() > kMinCycles &&
                 shortest >= kStates && longest <= kMaxCycleRatio * shortest;
  for (int& begin : found.cycles) begin += from;
  return found;
}

Result<std::vector<Segment>> propose_movement(const Recording& recording,
                                              const std::string& movement, const std::string& rest,
                                              Hold hold) {
  const VectorXd distance = distance_from_start(recording);
  const auto frames = static_cast<int>(distance.size());
  const double half = kBackShare * distance.maxCoeff();
  if (2.0 * half < kMinMovement_rad) {
    return fail("nothing moves in the take; a movement begins and ends in rest", recording.file);
  }
  if (distance[frames - 1] >= half) {
    return fail(
        "the take ends away from where it began; it needs rest, one movement, and the way "
        "back to rest",
        recording.file);
  }
  Index first = 0;
  while (distance[first] < half) ++first;
  Index last = frames - 1;
  while (distance[last] < half) --last;
  const int up = onset(distance, first, 1.0);
  const int down = onset(distance, last + 1, -1.0);
  if (down - up < kStates || frames - down < kStates) {
    return fail("the movement or the way back lasts fewer than " + std::to_string(kStates) +
                    " frames; train at a higher --rate",
                recording.file);
  }
  std::vector<Segment> segments{{up, down, movement}};
  if (hold == Hold::kCycles) {
    // The way up takes as long after half of the distance as before it.
    const int arrived = std::min(2 * static_cast<int>(first) - up, down);
    for (const int cut : cuts_of(recording, up, arrived, down)) {
      segments.back().end = cut;
      segments.push_back({cut, down, movement});
    }
  }
  segments.push_back({down, frames, rest});
  return segments;
}

}  // namespace posed::gesture
