#include "tests/bench/robot/take.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "models/hand/constraint_solver.hpp"
#include "models/hand/thumb_fit.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/support/hand_signs.hpp"

namespace posed::bench {
namespace {

constexpr double kMove_s = 0.5, kHold_s = 0.5;

// What a stream's stage `constrain` leaves of the angles.
HandTake kept(std::string name, std::vector<HandAngles> angles) {
  hand::ConstraintSolver solver;
  HandAngles variance;
  variance.fill(1.0);
  for (HandAngles& frame : angles) solver.step(frame, variance);
  return {.name = std::move(name), .angles = std::move(angles)};
}

HandAngles between(const HandAngles& from, const HandAngles& to, double share) {
  HandAngles angles;
  for (std::size_t c = 0; c < angles.size(); ++c) {
    angles[c] = from[c] + share * (to[c] - from[c]);
  }
  return angles;
}

// Minimum-jerk moves from pose to pose, and holds.
std::vector<HandAngles> moves_through(const std::vector<HandAngles>& poses) {
  constexpr int kMove = static_cast<int>(kMove_s * kTakeRate_hz);
  constexpr int kHold = static_cast<int>(kHold_s * kTakeRate_hz);
  std::vector<HandAngles> frames;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const HandAngles& from = poses[i == 0 ? 0 : i - 1];
    for (int t = 1; t <= kMove + kHold; ++t) {
      const double u = std::min(1.0, static_cast<double>(t) / kMove);
      frames.push_back(between(from, poses[i], u * u * u * (10.0 - u * (15.0 - 6.0 * u))));
    }
  }
  return frames;
}

double tip_gap_m(const hand::HandGeometry& geometry, const HandAngles& angles, int finger) {
  hand::HandPose pose;
  place(geometry, angles, pose);
  return (pose.to_m[2] - pose.to_m[3 * finger + 2]).norm() - geometry.fingers[0].radius_m[2] -
         geometry.fingers[finger].radius_m[2];
}

// The thumb's tip on that of a finger, by trying smaller and smaller steps of the angles that bring
// them together.
HandAngles pinch(const hand::HandGeometry& geometry, int finger) {
  const auto first = static_cast<std::size_t>(finger * kFingerChannels);
  std::vector<std::size_t> turned(hand::kThumbAngles.begin(), hand::kThumbAngles.end());
  turned.insert(turned.end(), {first, first + 1, first + 3, first + 6});
  HandAngles angles{};
  for (const std::size_t joint : {first, first + 3, first + 6}) angles[joint] = 0.5;
  const auto cost = [&](const HandAngles& at) {
    double sum = std::abs(tip_gap_m(geometry, at, finger));
    for (const std::size_t c : turned) sum += 1e-3 * at[c] * at[c];
    return sum;
  };
  double least = cost(angles);
  for (double step = 0.2; step > 1e-4; step *= 0.8) {
    for (const std::size_t c : turned) {
      for (const double turn : {step, -step}) {
        HandAngles tried = angles;
        tried[c] = std::clamp(tried[c] + turn, geometry.low_rad[c], geometry.high_rad[c]);
        const double found = cost(tried);
        if (found >= least) continue;
        least = found;
        angles = tried;
      }
    }
  }
  return angles;
}

}  // namespace

HandTake synthetic_take() {
  const hand::HandGeometry geometry = hand::hand_geometry(default_hand_shape());
  const HandAngles open{};
  HandAngles fist{}, spread{};
  for (int finger = 1; finger < kFingers; ++finger) {
    const auto first = static_cast<std::size_t>(finger * kFingerChannels);
    fist[first] = fist[first + 3] = 1.3;
    fist[first + 6] = 0.8;
    spread[first + 1] = finger == 2 ? 0.0 : 0.2;
  }
  HandAngles point = fist;
  for (const std::size_t joint : {0, 3, 6}) point[kFingerChannels + joint] = 0.0;
  std::vector<HandAngles> poses{open};
  for (int finger = 1; finger < kFingers; ++finger) {
    poses.insert(poses.end(), {pinch(geometry, finger), open, pinch(geometry, finger), spread});
  }
  poses.insert(poses.end(), {point, fist, open, point, pinch(geometry, 1), fist, open});
  return kept("made-up gestures", moves_through(poses));
}

Result<HandTake> read_take(const std::filesystem::path& path) {
  auto clip = TRY(clip::read_hand_clip(path));
  clip::fill_gaps(clip);
  if (clip.angles.size() < 2) return fail("has no two frames", path.string());
  std::vector<HandAngles> frames;
  std::size_t at = 0;
  for (double time_s = clip.time_s.front(); time_s <= clip.time_s.back();
       time_s += 1.0 / kTakeRate_hz) {
    while (at + 2 < clip.angles.size() && clip.time_s[at + 1] <= time_s) ++at;
    const double step_s = clip.time_s[at + 1] - clip.time_s[at];
    frames.push_back(
        between(clip.angles[at], clip.angles[at + 1], (time_s - clip.time_s[at]) / step_s));
  }
  return kept(path.filename().string(), std::move(frames));
}

Result<HandTake> signs_take(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "O.csv")) {
    return fail("holds no O.csv: name the folder of the signs", folder.string());
  }
  std::vector<HandAngles> poses{HandAngles{}};
  for (const test::ThumbSign& sign : test::kThumbSigns) {
    std::ranges::copy(test::sign_poses(folder, sign.name), std::back_inserter(poses));
  }
  return kept("signs", moves_through(poses));
}

}  // namespace posed::bench
