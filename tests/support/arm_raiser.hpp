// A synthetic body that raises an arm from where it hangs, holds it and lets it down, for tests
// without recordings. The motion is not anatomically correct, but its truth is known: an upper arm
// hangs at 70 degrees below the T-pose and is held 60 to 64 degrees above it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/random.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/degree.hpp"

namespace posed::test {

struct Raise {
  bool left = false, right = false;
  bool wave = false;       // the lower arms swing while the arms are held, which takes 4 s
  std::uint32_t take = 1;  // seeds noise, height and times
  double rate_hz = 30.0;
};

// How a lower arm waves.
inline constexpr double kWave_hz = 1.4, kWave_deg = 25.0;

// From 0 to 1 and back: up from 0.2 s on, a hold, down, and 0.5 s of rest.
inline double raised_at(double time_s, double hold_s) {
  const auto step = [](double t) {
    const double s = std::clamp(t, 0.0, 1.0);
    return s * s * s * (10.0 - s * (15.0 - 6.0 * s));
  };
  return step((time_s - 0.2) / 0.7) - step((time_s - 0.9 - hold_s) / 0.7);
}

inline clip::Clip raise_take(const Raise& raise) {
  auto walker = motion::make_walker({.seconds = 1.0, .rate_hz = raise.rate_hz});
  REQUIRE(walker.has_value());
  PortableRandom random(raise.take * 7919U + 3U);
  const double hold_s = random.uniform(0.7, 1.0) + (raise.wave ? 3.2 : 0.0);
  const double top_deg = random.uniform(60.0, 64.0);
  clip::Clip clip{.path = "synthetic raise",
                  .skeleton = walker->skeleton,
                  .frame_rate_hz = raise.rate_hz,
                  .channels = {},
                  .warnings = {}};
  const auto frames = static_cast<Eigen::Index>(std::lround((2.1 + hold_s) * raise.rate_hz));
  const auto channels = static_cast<Eigen::Index>(clip.skeleton->channels.size());
  clip.channels.resize(frames, channels);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const double time_s = static_cast<double>(t) / raise.rate_hz;
    const double up = raised_at(time_s, hold_s);
    const double swing_deg =
        raise.wave ? up * kWave_deg * std::sin(2.0 * std::numbers::pi * kWave_hz * time_s) : 0.0;
    for (Eigen::Index c = 0; c < channels; ++c) {
      const Channel& channel = clip.skeleton->channels[static_cast<std::size_t>(c)];
      const auto bone = clip.skeleton->joints[channel.joint].bone;
      double& value = clip.channels(t, c);
      if (channel.translation) {
        value = channel.axis == Axis::kY ? 0.94 : 0.0;
        continue;
      }
      const bool left = bone == Bone::kLeftUpperArm;
      const bool arm = (left || bone == Bone::kRightUpperArm) && channel.axis == Axis::kZ;
      const bool raised = left ? raise.left : raise.right;
      const double height_deg = raised ? -70.0 + (70.0 + top_deg) * up : -70.0;
      const double turn_deg = arm ? (left ? height_deg : -height_deg) : 0.0;
      const bool lower = (raise.left && bone == Bone::kLeftLowerArm) ||
                         (raise.right && bone == Bone::kRightLowerArm);
      const double wave_deg = lower && channel.axis == Axis::kY ? swing_deg : 0.0;
      value = kDegree * (turn_deg + wave_deg + 0.2 * random.normal());
    }
  }
  return clip;
}

}  // namespace posed::test
