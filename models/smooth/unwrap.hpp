// Unwrap: a skeleton's rotation channels as curves without jumps. Each channel takes the turn
// nearest to its value before; a joint of three axes also leaves the other of the two ways to say
// one rotation, (x + pi, pi - y, z + pi), when that is nearer.
#pragma once

#include <span>
#include <vector>

#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

class Unwrap {
 public:
  explicit Unwrap(const Skeleton& skeleton);

  // values: [rotation channels] rad, in place; not a number where missing, and left so. RT-safe.
  void apply(std::span<double> values_rad) noexcept;

  void reset() noexcept;  // RT-safe

 private:
  std::vector<int> joint_channels_;  // how many each turning joint has, in channel order
  std::vector<double> last_rad_;     // [rotation channels]; not a number before the first
};

}  // namespace posed::smooth
