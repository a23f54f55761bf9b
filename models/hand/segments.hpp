// The closest points of two line segments (models/hand/README.md, "Closest points of two
// segments"). RT-safe.
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace posed::hand {

struct Closest {
  double s = 0.0;                                   // position on the first segment, 0 to 1
  double t = 0.0;                                   // on the second
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  // from the second's point to the first's
};

[[nodiscard]] inline Closest closest_points(const Eigen::Vector3d& p1, const Eigen::Vector3d& q1,
                                            const Eigen::Vector3d& p2,
                                            const Eigen::Vector3d& q2) noexcept {
  constexpr double kPoint = 1e-18;  // a segment of smaller squared length counts as a point
  const Eigen::Vector3d d1 = q1 - p1;
  const Eigen::Vector3d d2 = q2 - p2;
  const Eigen::Vector3d r = p1 - p2;
  const double a = d1.squaredNorm();
  const double e = d2.squaredNorm();
  const double f = d2.dot(r);
  Closest closest;
  if (a > kPoint) {
    const double c = d1.dot(r);
    if (e > kPoint) {
      const double b = d1.dot(d2);
      const double determinant = a * e - b * b;
      const bool parallel = determinant <= 1e-12 * a * e;
      closest.s = parallel ? 0.0 : std::clamp((b * f - c * e) / determinant, 0.0, 1.0);
      closest.t = (b * closest.s + f) / e;
      if (closest.t < 0.0) {
        closest.t = 0.0;
        closest.s = std::clamp(-c / a, 0.0, 1.0);
      } else if (closest.t > 1.0) {
        closest.t = 1.0;
        closest.s = std::clamp((b - c) / a, 0.0, 1.0);
      }
    } else {
      closest.s = std::clamp(-c / a, 0.0, 1.0);
    }
  } else if (e > kPoint) {
    closest.t = std::clamp(f / e, 0.0, 1.0);
  }
  closest.apart = r + d1 * closest.s - d2 * closest.t;
  return closest;
}

}  // namespace posed::hand
