// Retarget: gives a pose of one skeleton to another, through the canonical humanoid
// (models/motion/README.md, "Retargeting"). Each bone of the target turns in the world as the
// source's does, relative to its own T-pose; the root's position is scaled by the length of the
// legs.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

// Const and shareable after bind().
class Retarget {
 public:
  // Fails when the two have no bone in common. Cold.
  static Result<Retarget> bind(std::shared_ptr<const Skeleton> from,
                               std::shared_ptr<const Skeleton> to);

  [[nodiscard]] const std::shared_ptr<const Skeleton>& target() const noexcept { return to_; }
  // Target's length of legs by the source's; 1 where one of them has no legs, or absurd ones.
  [[nodiscard]] double scale() const noexcept { return scale_; }

  // Replaces `out` by the pose of `in`, a frame of the source, with its header, quality, label and
  // times. A joint of the target that the source does not have, or did not measure, stays with its
  // parent as in the T-pose and is not valid. Angles are those nearest to the ones in `out`, so
  // that `out` is best the frame before.
  RT_SAFE void apply(const Frame& in, Frame& out) const noexcept;

 private:
  struct Part {
    int source = -1;                   // joint that turns this one; -1: none, it follows its parent
    Eigen::Quaterniond before, after;  // T of the source^-1, T of the target
  };

  Retarget() = default;

  std::shared_ptr<const Skeleton> from_, to_;
  std::vector<Part> parts_;  // [joint of the target]
  double scale_ = 1.0;
  std::uint16_t angles_ = 0;  // rotation channels of the target
};

}  // namespace posed::motion
