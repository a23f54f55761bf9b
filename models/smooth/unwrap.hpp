// Unwrap: removes jumps from a skeleton's rotation channels (models/smooth/README.md, "Unwrap").
// Each channel takes the multiple of a full turn that is nearest to its previous value. Three Euler
// angles describe a rotation in two ways, (x, y, z) and (x + pi, pi - y, z + pi); the one nearer to
// the previous frame is used. One thread.
#pragma once

#include <span>
#include <vector>

#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

class Unwrap {
 public:
  explicit Unwrap(const Skeleton& skeleton);

  // values_rad: [rotation channels], changed in place; NaN where missing, and left NaN. RT-safe.
  void apply(std::span<double> values_rad) noexcept;

  void reset() noexcept;  // RT-safe

 private:
  std::vector<int>
      joint_channels_;            // number of channels of each joint that has any, in channel order
  std::vector<double> last_rad_;  // [rotation channels]; NaN before the first value
};

}  // namespace posed::smooth
