// A synthetic hand for the live smoother (models/smooth/README.md, "Measured figures"): gestures g,
// c, p (and 1, 3, 4) with minimum-jerk transitions, personal jitter, a slow drift and a little
// sensor noise, 30 Hz. Degrees; [frames x 45].
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "proto/frame/hand.hpp"
#include "tests/support/grasps.hpp"

namespace posed::test {

struct SyntheticHand {
  Motion angles;
  std::string labels;                      // one letter per gesture
  std::vector<std::pair<int, int>> spans;  // first frame and end (excluded) of each gesture
};

namespace synthetic {

using Pose = Eigen::Matrix<double, 1, kHandChannels>;

inline bool open(char label, int finger) {
  switch (label) {
    case 'c':
      return finger == 1 || finger == 2;
    case 'p':
      return true;
    case '1':
      return finger == 1;
    case '3':
      return finger >= 1 && finger <= 3;
    case '4':
      return finger >= 1;
    default:
      return false;
  }
}

inline Pose pose(char label, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  constexpr std::array<double, 3> kOpen{8.0, 6.0, 4.0};
  constexpr std::array<double, 3> kThumb{32.0, 45.0, 50.0};
  constexpr std::array<double, 3> kClosed{68.0, 88.0, 58.0};
  constexpr std::array<double, 3> kJitter{5.0, 5.0, 3.0};
  Pose pose = Pose::Zero();
  for (int f = 0; f < kFingers; ++f) {
    const double jitter = normal(random);
    const bool is_open = open(label, f);
    const auto& flexion = is_open ? kOpen : f == 0 ? kThumb : kClosed;
    double* const finger = pose.data() + f * kFingerChannels;
    for (std::size_t j = 0; j < 3; ++j) finger[3 * j] = flexion[j] + jitter * kJitter[j];
    finger[1] = (f - 2) * (is_open ? 6.0 : 1.5) + jitter * 1.5;
    finger[2] = (is_open ? 0.0 : 3.0) + jitter;
  }
  return pose;
}

inline double minimum_jerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
}

}  // namespace synthetic

// `gestures` random gestures of `alphabet`, none twice in a row.
inline SyntheticHand synthetic_hand(int gestures, unsigned seed,
                                    const std::string& alphabet = "gcp") {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<std::size_t> letter(0, alphabet.size() - 1);
  SyntheticHand hand;
  while (std::ssize(hand.labels) < gestures) {
    const char next = alphabet[letter(random)];
    if (hand.labels.empty() || hand.labels.back() != next) hand.labels.push_back(next);
  }
  std::vector<synthetic::Pose> rows;
  synthetic::Pose now = synthetic::pose(hand.labels[0], random);
  synthetic::Pose drift = synthetic::Pose::Zero();
  for (const char label : hand.labels) {
    const synthetic::Pose target = synthetic::pose(label, random);
    const int frames = static_cast<int>(std::clamp(62.0 + 9.0 * normal(random), 38.0, 95.0));
    const double transition = std::uniform_real_distribution<double>(14.0, 22.0)(random);
    std::array<double, kFingers> late{};
    for (double& frame : late) frame = 4.0 + 2.0 * normal(random);
    const int first = static_cast<int>(rows.size());
    synthetic::Pose x = now;
    for (int t = 0; t < frames; ++t) {
      for (int c = 0; c < kHandChannels; ++c) {
        const double s = (t - late[static_cast<std::size_t>(c / kFingerChannels)]) / transition;
        x[c] = now[c] + synthetic::minimum_jerk(s) * (target[c] - now[c]);
        drift[c] = 0.97 * drift[c] + 0.25 * normal(random);
      }
      rows.push_back(x + drift);
      for (double& value : rows.back().reshaped()) value += 0.25 * normal(random);
    }
    hand.spans.emplace_back(first, static_cast<int>(rows.size()));
    now = x;
  }
  hand.angles.resize(static_cast<Eigen::Index>(rows.size()), kHandChannels);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    hand.angles.row(static_cast<Eigen::Index>(i)) = rows[i];
  }
  return hand;
}

}  // namespace posed::test
