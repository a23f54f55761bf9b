// Standing: keeps the feet of a performing body where they are (models/perform/README.md,
// "Bodies"). A gesture model knows no place of the root, so the root moves by as much as brings the
// middle of the two feet back. RT-safe except for construction.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::perform {

class Standing {
 public:
  // A skeleton without feet is served, too: its root stays where it is. Cold.
  explicit Standing(const Skeleton& skeleton);

  // Where the feet of a frame are in the world [m]; those that the skeleton lacks are NaN.
  using Feet = std::array<Eigen::Vector3d, 2>;
  [[nodiscard]] Feet feet_m(const Frame& frame) const noexcept;

  // Moves the root of a frame so that the middle of its feet is that of `places_m`; returns how far
  // a foot then is from its place at most [m].
  double stand(const Feet& places_m, Frame& frame) const noexcept;

 private:
  struct Link {
    int joint = 0;
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  // from the parent, in the parent's axes
  };
  using Chain = std::vector<Link>;  // from the top of the skeleton down

  [[nodiscard]] static Eigen::Vector3d place_m(const Chain& chain, const Frame& frame) noexcept;

  Chain root_;
  std::array<Chain, 2> feet_;  // empty: there is no such foot
};

}  // namespace posed::perform
