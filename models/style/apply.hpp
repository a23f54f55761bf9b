// A whole clip through the style stage: the same code as live, one frame after the other. Cold.
#pragma once

#include <functional>

#include "models/style/style_filter.hpp"
#include "models/style/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

struct ApplyOptions {
  FilterOptions filter;
  // Exactly a live start: alpha ramps up from 0, the heading is found on the way. Otherwise both
  // are settled from the first frame.
  bool cold = false;
  std::function<bool(int done, int total)> progress;  // may be empty; false stops the work
};

struct Applied {
  // The input's joints, hierarchy, channels, rate and frame count. What no style changed keeps its
  // channel values; the angles of what changed are the turn nearest to the frame before. An Acclaim
  // clip comes back with Z, Y, X rotation channels on every joint.
  clip::Clip clip;
  int joints_changed = 0;
  double rms_change_rad = 0.0;  // motion::TurnSum: over frames and changed joints
  double max_change_rad = 0.0;
};

// Refuses a clip without frames or with a value that is not finite, and a skeleton that cannot
// serve the model; the error names what is missing. `model_name` is for errors.
[[nodiscard]] Result<Applied> apply_to_clip(const StyleModel& model, const std::string& model_name,
                                            const clip::Clip& clip, const ApplyOptions& options);

}  // namespace posed::style
