#include "drivers/glove/glove_emulator.hpp"

#include <cmath>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers::glove {

void GloveEmulator::pose(std::size_t body, const Frame& frame) {
  if (body != 0 || frame.angle_count != kHandChannels) return;
  HandAngles angles = hand_angles(frame);
  for (double& angle_rad : angles) {
    if (!std::isfinite(angle_rad)) angle_rad = 0.0;
  }
  pose_hand(angles);
}

// A glove takes the angles, which are the same for both hands.
Frame hand_frame(const HandAngles& angles) {
  static const Skeleton skeleton = hand_skeleton(Side::kRight);
  Frame frame;
  set_hand_angles(skeleton, angles, frame);
  return frame;
}

}  // namespace posed::drivers::glove
