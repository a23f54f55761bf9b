// Hinges: knees and elbows bend one way. A style that is turned round or doubled would bend them
// the other way (models/style/README.md, "Filter"). Const and shareable; RT-safe after the
// constructor.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {

class Hinges {
 public:
  // Those that the skeleton, which must outlive this, has. Cold.
  explicit Hinges(const Skeleton& skeleton);

  // Turns each hinge of `styled` back that bends the wrong way, and by more than with the rotations
  // `in` [joint]. Returns the largest of these turns [rad]. All others keep every bit, and so do
  // hinges that bend far the wrong way with `in`: such a figure bends otherwise.
  RT_SAFE double hold(std::span<const Quatf> in, Frame& styled) const noexcept;

 private:
  // Seen from the bone above, in the axes of the T-pose.
  struct Hinge {
    int joint = 0;
    Eigen::Quaterniond above, below;  // canonical rotation = above * local * below
    Eigen::Vector3d axis;             // bends about it
    Eigen::Vector3d straight;         // where the bone points in the T-pose

    [[nodiscard]] double bend_rad(std::span<const Quatf> rotations) const noexcept;
  };

  const Skeleton* skeleton_;
  std::vector<Hinge> hinges_;
};

}  // namespace posed::style
