#include "proto/frame/rotation.hpp"

namespace posed {

// Not inline: Eigen's FromTwoVectors holds a singular value decomposition, which would cost every
// file that includes the header several seconds of compile time.
Eigen::Quaterniond minimal_rotation(const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& to) noexcept {
  if (from.norm() < 1e-12 || to.norm() < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace posed
