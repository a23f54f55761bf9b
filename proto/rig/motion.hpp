// The clip as the recogniser asks it: world rotations and positions of some poses. Without a clip,
// as for a live skeleton, it holds the zero pose once. Cold.
#pragma once

#include <vector>

#include "proto/rig/figure.hpp"

namespace posed::rig {

class Motion {
 public:
  // Poses that do not fit the figure, or are not finite, count as none.
  Motion(const Figure& figure, const RigPoses& poses);

  [[nodiscard]] int poses() const { return poses_; }
  [[nodiscard]] const Mat& world(int pose, int joint) const { return world_[index(pose, joint)]; }
  [[nodiscard]] const Vec& position(int pose, int joint) const {
    return position_[index(pose, joint)];
  }
  // Mean over the poses of `value(pose)`.
  template <typename Value>
  [[nodiscard]] double mean(Value value) const {
    double sum = 0.0;
    for (int i = 0; i < poses_; ++i) sum += value(i);
    return sum / poses_;
  }

 private:
  [[nodiscard]] std::size_t index(int pose, int joint) const {
    return static_cast<std::size_t>(pose) * joints_ + joint;
  }

  int poses_ = 0;
  int joints_ = 0;
  std::vector<Mat> world_;     // [pose x joint]
  std::vector<Vec> position_;  // [pose x joint]
};

}  // namespace posed::rig
