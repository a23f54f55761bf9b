// Poses shared by the tests of the hand.
#pragma once

#include <cstddef>
#include <random>

#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"

namespace posed::test {

// Index in HandAngles; joints and axes (x, y, z) from 0.
constexpr std::size_t angle(int finger, int joint, int axis) {
  return static_cast<std::size_t>(kFingerChannels * finger + 3 * joint + axis);
}

inline HandAngles same_variance() {
  HandAngles variance;
  variance.fill(1.0);
  return variance;
}

// All fingers through each other: index over middle, ring over little.
inline HandAngles crossed() {
  HandAngles angles{};
  for (int finger = 0; finger < kFingers; ++finger) {
    angles[angle(finger, 0, 0)] = 60 * kDegree;
    angles[angle(finger, 1, 0)] = 40 * kDegree;
    angles[angle(finger, 0, 1)] = (finger == 2 ? 10 : -40) * kDegree;
  }
  return angles;
}

inline HandAngles any_angles(std::mt19937& random, double most_rad) {
  std::uniform_real_distribution<double> any(-most_rad, most_rad);
  HandAngles angles;
  for (double& angle_rad : angles) angle_rad = any(random);
  return angles;
}

}  // namespace posed::test
