// Whether two clips show the same motion: joints of the same names are where they were, turned as
// they were, in every frame.
#pragma once

#include <cstddef>
#include <string>

#include <catch2/catch.hpp>

#include "models/motion/kinematics.hpp"
#include "proto/clip/clip.hpp"

namespace posed::test {

// `prefix` stands before the names of `back`.
inline void check_same_motion(const clip::Clip& clip, const clip::Clip& back,
                              const std::string& prefix = "") {
  REQUIRE(back.frames() == clip.frames());
  CHECK(back.frame_rate_hz == Approx(clip.frame_rate_hz));
  for (int i = 0; i < clip.frames(); ++i) {
    const auto truth = motion::world_pose(*clip.skeleton, clip.frame(i));
    const auto got = motion::world_pose(*back.skeleton, back.frame(i));
    for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
      const int joint = back.skeleton->joint_index(prefix + clip.skeleton->joints[j].name);
      REQUIRE(joint >= 0);
      const auto k = static_cast<std::size_t>(joint);
      CHECK((got.position_m[k] - truth.position_m[j]).norm() < 1e-4);
      CHECK(angle_between_rad(got.rotation[k], truth.rotation[j]) < 1.7e-4);  // 0.01 deg
    }
  }
}

}  // namespace posed::test
