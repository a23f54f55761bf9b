// `posed train gesture --auto-label`: proposes labels for a recording of which few parts are
// labelled.
#pragma once

#include <filesystem>

#include "proto/clip/clip.hpp"

namespace posed::cli {

struct AutoLabelOptions {
  std::filesystem::path clip, examples, out;
  double rate_hz;
  clip::ReadOptions read;
  bool json;
};

// Returns the exit code; prints results on stdout and errors on stderr.
[[nodiscard]] int auto_label(const AutoLabelOptions& options);

}  // namespace posed::cli
