#include "proto/frame/rotation.hpp"

namespace posed {

// Eigen's FromTwoVectors with another choice where the vectors are opposite: it takes the axis from
// a singular value decomposition there, which every file that includes it compiles for 7 s.
Eigen::Quaterniond minimal_rotation(const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& to) noexcept {
  if (from.norm() < 1e-12 || to.norm() < 1e-12) return Eigen::Quaterniond::Identity();
  const Eigen::Vector3d a = from.normalized();
  const Eigen::Vector3d b = to.normalized();
  Eigen::Quaterniond turn;
  const double cosine = b.dot(a);
  if (cosine < -1.0 + 1e-12) {
    turn.w() = 0.0;
    turn.vec() = a.unitOrthogonal();
    return turn;
  }
  const double s = std::sqrt((1.0 + cosine) * 2.0);
  turn.vec() = a.cross(b) * (1.0 / s);
  turn.w() = s * 0.5;
  return turn;
}

}  // namespace posed
