// `posed train gesture --auto-label`: few labels in, proposed labels out.
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

// The exit code; reports on stdout and stderr.
[[nodiscard]] int auto_label(const AutoLabelOptions& options);

}  // namespace posed::cli
