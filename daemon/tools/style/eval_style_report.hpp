// What `posed eval style --report` shows. Cold.
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "models/motion/pose_space.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// The clips that were compared, and how the model sees them.
struct EvaluatedClips {
  clip::Clip source, styled, target;
  motion::Space space = motion::Space::kNative;
  double rate_hz = 30.0;
};

// `figures`: what `--json` prints.
[[nodiscard]] Result<> write_eval_style_report(const nlohmann::json& figures,
                                               const EvaluatedClips& clips,
                                               const std::filesystem::path& path);

}  // namespace posed::tools
