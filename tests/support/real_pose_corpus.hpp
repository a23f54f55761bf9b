// A labelled hand recording strung together from real CyberGlove poses (models/gesture/README.md,
// measured figures): random gestures, minimum-jerk moves of 0.3 to 0.6 s, holds of 1 to 2 s, half
// of the poses' real spread, slow drift and 0.3 degrees of sensor noise.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "models/gesture/recording.hpp"

namespace posed::test {

// The letters of the sign alphabet whose hand poses are the labels of Takamido et al.
// (models/gesture/README.md, "References").
inline const std::map<std::string, std::string> kSignOf{{"g", "A"}, {"c", "V"}, {"p", "4"},
                                                        {"1", "G"}, {"3", "W"}, {"4", "B"}};

// The 100 rows of a sign: the maker's library's angles of the sensors 0 to 21 (`SensorIndex`)
// [rad], which is not the order of the glove's bytes: all rows keep the library's rule between
// abductions (real_poses_test.cpp).
inline constexpr std::size_t kLibrasAngles = 22;
[[nodiscard]] std::vector<std::vector<double>> libras_rows(const std::filesystem::path& folder,
                                                           const std::string& sign);

// The same as hands [pose][45 angles, rad]; `folder` is data/gloves/libras_cyberglove.
[[nodiscard]] gesture::FeatureMatrix libras_poses(const std::filesystem::path& folder,
                                                  const std::string& sign);

// What a label that is no part of the corpus can be composed of at best: each finger but the thumb
// as in that of g, c, p whose mean is nearest to the label's. Rms of the flexion angles from the
// label's mean [deg].
[[nodiscard]] double best_composition_deg(const std::filesystem::path& folder,
                                          const std::string& label);

// A recording of `gestures` gestures of g, c, p at 30 Hz, never the same twice in a row.
[[nodiscard]] gesture::Recording real_pose_corpus(const std::filesystem::path& folder,
                                                  std::uint32_t seed, int gestures = 100);

}  // namespace posed::test
