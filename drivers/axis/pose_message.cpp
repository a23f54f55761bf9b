#include "drivers/axis/pose_message.hpp"

#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::axis {

RT_SAFE Turned fill_values(const Skeleton& skeleton, const Proportions& offset_cm,
                           std::span<const Quatf> rotation_xyzw, const Vec3f& root_m,
                           LastPose& last, Message& message) noexcept {
  Turned turned;
  // Adding zero makes a negative zero positive: the same pose gives the same bytes.
  const auto angles_at = [&](std::size_t joint, std::size_t at) {
    if (rotation_xyzw[joint] == last.rotation_xyzw[joint]) return;
    last.rotation_xyzw[joint] = rotation_xyzw[joint];
    turned.set(joint);
    auto& near_rad = last.near_rad[joint];
    near_rad = channels_from_rotation(skeleton, static_cast<int>(joint),
                                      to_eigen_double(rotation_xyzw[joint]), near_rad);
    for (std::size_t i = 0; i < 3; ++i) message.values[at + i] = near_rad[i] / kDegree + 0.0;
  };
  const std::size_t root = skeleton.root_joint;
  Eigen::Vector3d at_m(root_m[0], root_m[1], root_m[2]);
  if (root == 1) {  // the reference stays at the origin
    angles_at(0, 3);
    at_m = to_eigen_double(rotation_xyzw[0]).conjugate() * at_m;
  }
  for (std::size_t b = 0; b < kBones; ++b) {
    const std::size_t at = rotations_at(message.content, b);
    angles_at(root + b, at);
    if (b != kHips && !message.content.displacement) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      message.values[at - 3 + i] = b == kHips ? at_m[static_cast<int>(i)] / kCentimetre_m
                                              : static_cast<double>(offset_cm[b][i]);
    }
  }
  return turned;
}

}  // namespace posed::drivers::axis
