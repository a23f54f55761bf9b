// Inputs by which the live smoother is judged: real and made hand motions at the rates of several
// devices, each with the noises that devices have. Cold; for the benchmark and tests.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/baselines.hpp"

namespace posed::bench {

// kTune: what constants may be chosen on; kJudge: other recordings, people, signs, frequencies and
// seeds.
enum class Half { kTune, kJudge };

struct SmoothInput {
  std::string motion, noise;
  std::vector<Trial> trials;
  double noise_deg = 1.0;  // that the Kalman baseline assumes
};

// `gloves` holds the folders graspdb14_cyberglove, vmg30_grasps and libras_cyberglove of public
// recordings; motions whose folder is missing are left out.
[[nodiscard]] std::vector<SmoothInput> smooth_inputs(const std::filesystem::path& gloves,
                                                     Half half);

// The live stage with the noise that it estimates itself; row t is the estimate of frame t [deg].
[[nodiscard]] clip::ChannelMatrix live_stage(const Trial& trial, int lag);

}  // namespace posed::bench
