// The baseline that Debian packages: `mlpg` of SPTK 3.9, run as a process. For the bench and its
// test.
#pragma once

#include <filesystem>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::bench {

inline constexpr const char* kSptkMlpg = "/usr/libexec/sptk/bin/mlpg";

// InformationForm as mlpg reads it: per frame the means, then the variances, each
// [window][channel].
struct SptkInput {
  int channels = 0;
  std::vector<float> values;
};

struct SptkRun {
  std::vector<float> trajectory;  // [frame][channel]
  double seconds = 0.0;           // the whole process, files in memory where /tmp is
};

// With influence range `range` (-s), which has delay range + 1. Refuses when sptk is not installed.
[[nodiscard]] Result<SptkRun> run_sptk(const SptkInput& input, int range,
                                       const std::filesystem::path& folder);

}  // namespace posed::bench
