// `posed train gesture --auto-label`: proposes labels for a recording of which few parts are
// labelled, or which is a single movement.
#pragma once

#include <filesystem>
#include <string>

#include "proto/clip/clip.hpp"

namespace posed::tools {

inline constexpr const char* kDefaultRest = "rest";

struct AutoLabelOptions {
  std::filesystem::path clip, examples, out;
  std::string movement, rest;  // of a take without examples
  bool body;                   // such a take is of a body
  bool cycles;                 // its hold is cut so that it can be repeated
  double rate_hz;
  clip::ReadOptions read;
  bool json;
};

// Returns the exit code; prints results on stdout and errors on stderr.
[[nodiscard]] int auto_label(const AutoLabelOptions& options);

}  // namespace posed::tools
