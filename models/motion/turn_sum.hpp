// TurnSum defines "degrees rms" of a change of poses everywhere in posed: the angle of the rotation
// between the pose before and the pose after, root mean square over frames and over the joints that
// the change turns at all. Cold.
#pragma once

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>

#include "proto/frame/frame.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::motion {

class TurnSum {
 public:
  // One joint of the current frame; a joint beyond kMaxJoints is ignored.
  void add(std::size_t joint, const Quatf& before, const Quatf& after) {
    if (before == after || joint >= kMaxJoints) return;
    turned_.set(joint);
    const double angle_rad = angle_between_rad(to_eigen_double(before), to_eigen_double(after));
    squares_ += angle_rad * angle_rad;
    max_rad_ = std::max(max_rad_, angle_rad);
  }
  void end_frame() { ++frames_; }

  [[nodiscard]] int joints() const { return static_cast<int>(turned_.count()); }
  [[nodiscard]] double max_rad() const { return max_rad_; }
  [[nodiscard]] double rms_rad() const {
    const double terms = static_cast<double>(turned_.count()) * static_cast<double>(frames_);
    return terms > 0.0 ? std::sqrt(squares_ / terms) : 0.0;
  }

 private:
  std::bitset<kMaxJoints> turned_;
  std::size_t frames_ = 0;
  double squares_ = 0.0, max_rad_ = 0.0;
};

}  // namespace posed::motion
