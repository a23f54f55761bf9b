// `mlpg` of SPTK 3.9 (a Debian package) as a baseline, run as a process. For the benchmark and its
// test.
#pragma once

#include <filesystem>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::bench {

inline constexpr const char* kSptkMlpg = "/usr/libexec/sptk/bin/mlpg";

// An InformationForm in mlpg's input format: for each frame the means, then the variances, each
// [window][channel].
struct SptkInput {
  int channels = 0;
  std::vector<float> values;
};

struct SptkRun {
  std::vector<float> trajectory;  // [frame][channel]
  double seconds = 0.0;           // of the whole process; files are in memory if /tmp is
};

// Runs mlpg with the influence range `range` (-s), whose delay is range + 1. Returns an error when
// sptk is not installed.
Result<SptkRun> run_sptk(const SptkInput& input, int range, const std::filesystem::path& folder);

}  // namespace posed::bench
