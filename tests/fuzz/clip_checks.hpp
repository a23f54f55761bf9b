// Properties of every clip that a reader accepts.
#pragma once

#include <cmath>

#include "proto/clip/clip.hpp"
#include "tests/fuzz/demand.hpp"

namespace posed::test {

inline void check_clip(const clip::Clip& clip) {
  const Skeleton& skeleton = *clip.skeleton;
  fuzz::demand(clip.frames() > 0 && clip.frame_rate_hz > 0.0);
  fuzz::demand(static_cast<std::size_t>(clip.channels.cols()) == skeleton.channels.size());
  fuzz::demand(clip.channels.allFinite());
  for (const Joint& joint : skeleton.joints) {
    fuzz::demand(joint.offset_m.allFinite());
    fuzz::demand(std::abs(joint.T_world_joint.norm() - 1.0) < 1e-6);
  }
  const Frame frame = clip.frame(clip.frames() - 1);
  fuzz::demand(frame.joint_count == skeleton.joints.size());
  for (int j = 0; j < frame.joint_count; ++j) {
    float norm = 0.0F;
    for (const float value : frame.rotation_xyzw[static_cast<std::size_t>(j)])
      norm += value * value;
    fuzz::demand(std::abs(norm - 1.0F) < 1e-4F);
  }
  for (const float value : frame.root_position_m) fuzz::demand(std::isfinite(value));
  (void)clip::with_zyx_channels(clip);
}

}  // namespace posed::test
