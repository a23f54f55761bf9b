// How far two poses of a vocabulary are apart (models/gesture/README.md, "Distance of poses").
// Cold.
#pragma once

#include <span>

#include "models/gesture/vocabulary.hpp"

namespace posed::gesture {

// A sum of squared differences, and the number of its terms.
struct Apart {
  double squares_rad2 = 0.0;
  int count = 0;

  void add(const Apart& other) {
    squares_rad2 += other.squares_rad2;
    count += other.count;
  }
  [[nodiscard]] double rms_rad() const;  // 0 without any
};

// The distance in one group: for a hand the differences of its angles, for a body the angles
// between each joint's two rotations. Poses are [channel], rad.
[[nodiscard]] Apart apart(const Vocabulary& vocabulary, const ChannelGroup& group,
                          std::span<const double> a, std::span<const double> b);
// The distance in all groups together.
[[nodiscard]] Apart apart(const Vocabulary& vocabulary, std::span<const double> a,
                          std::span<const double> b);

}  // namespace posed::gesture
