#include "models/gesture/movement_label.hpp"

#include <algorithm>
#include <cmath>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kAverage_s = 0.07;          // half width of the moving average
constexpr double kLeast_rad = 10 * kDegree;  // norm over all joints: less is no movement
constexpr double kOnsetShare = 0.1;          // of the fastest frame: here a way begins
constexpr double kBackShare = 0.5;           // of the farthest distance: a take ends nearer

// How far each frame is from the first one [rad], smoothed over time.
VectorXd distance_from_start(const Recording& recording) {
  const FeatureMatrix& angles = recording.angles_rad;
  const VectorXd off = (angles.rowwise() - angles.row(0)).rowwise().norm();
  const auto half = static_cast<Index>(std::lround(kAverage_s * recording.rate_hz));
  VectorXd smooth(off.size());
  for (Index t = 0; t < off.size(); ++t) {
    const Index from = std::max<Index>(t - half, 0);
    smooth[t] = off.segment(from, std::min(t + half + 1, off.size()) - from).mean();
  }
  return smooth;
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

Result<std::vector<Segment>> propose_movement(const Recording& recording,
                                              const std::string& movement,
                                              const std::string& rest) {
  const VectorXd distance = distance_from_start(recording);
  const auto frames = static_cast<int>(distance.size());
  const double half = kBackShare * distance.maxCoeff();
  if (2.0 * half < kLeast_rad) {
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
  return std::vector<Segment>{{up, down, movement}, {down, frames, rest}};
}

}  // namespace posed::gesture
