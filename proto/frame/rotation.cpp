#include "proto/frame/rotation.hpp"

namespace posed {

// Not inline: Eigen's FromTwoVectors contains a singular value decomposition, which would add
// several seconds of compile time to every file that includes the header.
Eigen::Quaterniond minimal_rotation(const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& to) noexcept {
  if (from.norm() < 1e-12 || to.norm() < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace posed
