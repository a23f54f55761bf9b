#include "models/gesture/pose_distance.hpp"

#include <cmath>

#include "proto/frame/rotation.hpp"

namespace posed::gesture {

double Apart::rms_rad() const { return count > 0 ? std::sqrt(squares_rad2 / count) : 0.0; }

Apart apart(const Vocabulary& vocabulary, const ChannelGroup& group, std::span<const double> a,
            std::span<const double> b) {
  const auto first = static_cast<std::size_t>(group.first);
  const auto end = first + static_cast<std::size_t>(group.channels);
  Apart sum;
  if (vocabulary.is_hand()) {
    for (std::size_t c = first; c < end; ++c) sum.add({(a[c] - b[c]) * (a[c] - b[c]), 1});
    return sum;
  }
  for (std::size_t c = first; c < end; c += 3) {
    const auto turn = [c](std::span<const double> pose) {
      return rotation_exp(Eigen::Vector3d(pose[c], pose[c + 1], pose[c + 2]));
    };
    const double angle_rad = angle_between_rad(turn(a), turn(b));
    sum.add({angle_rad * angle_rad, 1});
  }
  return sum;
}

Apart apart(const Vocabulary& vocabulary, std::span<const double> a, std::span<const double> b) {
  Apart sum;
  for (const ChannelGroup& group : vocabulary.groups) sum.add(apart(vocabulary, group, a, b));
  return sum;
}

}  // namespace posed::gesture
