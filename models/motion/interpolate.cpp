#include "models/motion/interpolate.hpp"

#include <cmath>

#include "proto/frame/rotation.hpp"

namespace posed::motion {

RT_SAFE void interpolate(const Skeleton& skeleton, const Frame& a, const Frame& b, double share,
                         Frame& out) noexcept {
  for (std::size_t i = 0; i < out.root_position_m.size(); ++i) {
    out.root_position_m[i] =
        std::lerp(a.root_position_m[i], b.root_position_m[i], static_cast<float>(share));
  }
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Eigen::Quaterniond from = to_eigen_double(a.rotation_xyzw[j]);
    const Eigen::Quaterniond to = to_eigen_double(b.rotation_xyzw[j]);
    const bool both = a.valid[j] && b.valid[j];
    const Eigen::Quaterniond between = both ? from.slerp(share, to) : b.valid[j] ? to : from;
    set_rotation(skeleton, static_cast<int>(j), between, out);
    out.valid[j] = both;
  }
}

}  // namespace posed::motion
