// A labelled hand recording strung together from real CyberGlove poses (models/gesture/README.md,
// measured figures): random gestures, minimum-jerk moves of 0.3 to 0.6 s, holds of 1 to 2 s, half
// of the poses' real spread, slow drift and 0.3 degrees of sensor noise.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "models/gesture/recording.hpp"

namespace posed::test {

// The letters of the sign alphabet whose hand poses are the labels of Takamido et al.
// (models/gesture/README.md, "References").
inline const std::map<std::string, std::string> kSignOf{{"g", "A"}, {"c", "V"}, {"p", "4"},
                                                        {"1", "G"}, {"3", "W"}, {"4", "B"}};

// The 100 poses of a sign [pose][45 angles, rad]; `folder` is data/gloves/libras_cyberglove.
[[nodiscard]] gesture::FeatureMatrix libras_poses(const std::filesystem::path& folder,
                                                  const std::string& sign);

// A recording of `gestures` gestures of g, c, p at 30 Hz, never the same twice in a row.
[[nodiscard]] gesture::Recording real_pose_corpus(const std::filesystem::path& folder,
                                                  std::uint32_t seed, int gestures = 100);

}  // namespace posed::test
