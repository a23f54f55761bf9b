// The training data and the streams of the demo: synthetic walkers as BVH files, a synthetic
// signer's glove as CSV with labels, and the names of the models trained from them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::tools {

// The style model's file name in the demo's folder; config/demo.toml names it, too.
inline constexpr const char* kDemoModel = "walk-to-sneak.style";
// The walker that is streamed; it is not in the training data.
inline constexpr const char* kDemoWalker = "new_walker.bvh";

// The gesture model, trained with g, c and p; and a signer who is not in its training data.
inline constexpr const char* kDemoHand = "hand.gesture";
inline constexpr const char* kDemoSigner = "new_performer.csv";

// The model for a camera's hands, trained with g, c, p, 1, 3 and 4 as a camera sees them.
inline constexpr const char* kDemoCamera = "camera.gesture";

struct LabelledClip {
  std::filesystem::path clip, labels;
};

struct DemoClips {
  std::vector<std::filesystem::path> from, to;  // walks of the two families
  LabelledClip glove;                           // 100 gestures of one signer
  std::vector<LabelledClip> camera;             // takes of drawn hands
};

// The files that make_demo_clips() and the training write into the folder.
[[nodiscard]] std::vector<std::string> demo_file_names();

// Writes the clips of both families and the new walker, the glove recording with its labels and the
// new signer into `folder`, which is created.
Result<DemoClips> make_demo_clips(const std::filesystem::path& folder);

}  // namespace posed::tools
