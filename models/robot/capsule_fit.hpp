// The capsule that holds points. Cold.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

namespace posed::robot {

// Along z of `at`, which is its middle; `length_m` without its caps.
struct CapsuleFit {
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  double radius_m = 0.0, length_m = 0.0;
};

using CapsuleCost = std::function<double(const CapsuleFit&)>;
[[nodiscard]] double volume(const CapsuleFit& fit);  // over pi

// That of the least cost along the points' three main directions and along the axes. Needs a point.
CapsuleFit fit_capsule(const std::vector<Eigen::Vector3d>& corners,
                       const CapsuleCost& cost = volume);

}  // namespace posed::robot
