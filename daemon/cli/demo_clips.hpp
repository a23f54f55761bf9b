// What the demo learns from and streams: synthetic walkers as BVH files, and the model made of
// them.
#pragma once

#include <filesystem>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::cli {

// The model's name inside the demo's folder; config/demo.toml names it too.
inline constexpr const char* kDemoModel = "march-to-sway.style";
// The walker that is streamed and was not learnt from.
inline constexpr const char* kDemoWalker = "new_walker.bvh";

struct DemoClips {
  std::vector<std::filesystem::path> from, to;
};

// Writes the clips of both families and the new walker into `folder`, which is made.
[[nodiscard]] Result<DemoClips> make_demo_clips(const std::filesystem::path& folder);

}  // namespace posed::cli
