// LegSignal: how far the right thigh is ahead of the left one, the reference signal of strides.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

// The signal on one skeleton. Const and shareable after find().
class LegSignal {
 public:
  // Empty for a skeleton that does not name both upper legs. Cold.
  [[nodiscard]] static std::optional<LegSignal> find(const Skeleton& skeleton);

  // Whether this frame measured both thighs.
  RT_SAFE [[nodiscard]] bool measured(const Frame& frame) const noexcept;

  // Right minus left flexion of the thigh against its parent joint [rad], forward positive.
  // Meaningless unless measured(). Not unwrapped: a thigh that passes straight up jumps.
  RT_SAFE [[nodiscard]] double value_rad(const Frame& frame) const noexcept;

 private:
  // The joint's rotation in canonical axes is before * L * after; L is its rotation in the frame.
  struct Thigh {
    std::size_t joint = 0;
    Eigen::Quaterniond before, after;
  };

  LegSignal(const Skeleton& skeleton, int right, int left);

  std::array<Thigh, 2> thighs_;  // right, left
};

}  // namespace posed::motion
