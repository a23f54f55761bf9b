// The clip and the corpus of `posed eval natural`: bodies or hands, read and measured. Cold.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "models/natural/figures.hpp"
#include "models/tasks.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct NaturalOptions {
  std::filesystem::path clip, corpus;  // a file, a folder
  std::filesystem::path skeleton;  // of the AMC clip, and of the corpus' without one beside them
  std::string hand;                // "left" or "right": the hand of clips with bodies
  double rate_hz = 30.0;
};

// A file of the corpus that is not compared with, and why.
struct LeftOut {
  std::string file, why;
};

struct NaturalClips {
  natural::Figures clip;
  std::vector<natural::Figures> corpus;
  std::vector<LeftOut> left_out;
  std::vector<std::string> joints;  // of bodies, that are compared: three channels each
};

// Receives the fraction done; returning false stops.
using ReadProgress = std::function<bool(double fraction)>;

// Every file of the corpus is a task. Errors: the clip itself cannot be measured, a part of the
// folder cannot be read, it has no clips, fewer than natural::kMinClips can be compared with, or
// a stop. Clips with other joints, too short ones and the clip itself are left out.
Result<NaturalClips> read_natural_clips(const NaturalOptions& options, TaskRunner& tasks,
                                        const ReadProgress& progress);

}  // namespace posed::tools
