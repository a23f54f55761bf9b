// Applies a style to a whole clip with the same stage as live, frame by frame. Cold.
#pragma once

#include <functional>
#include <optional>

#include "models/feet/root_motion.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

struct ApplyOptions {
  FilterOptions filter{};
  // True: start exactly as live, with alpha ramping up from 0 and the heading found on the way.
  // False: alpha and heading are settled from the first frame.
  bool cold = false;
  // What the feet stage behind the style does with the root; empty: there is no such stage.
  std::optional<feet::RootOptions> feet{};
  bool needs_feet = true;          // false: a figure that cannot have that stage goes without
  std::optional<Walker> walker{};  // measured before (measure_walker)
  std::function<bool(int done, int total)>
      progress{};  // may be empty; returning false stops the work
};

struct Applied {
  // The input's joints, hierarchy, channels, rate and frame count. Joints that the style does not
  // change keep their channel values; the angles of changed joints are chosen within half a turn of
  // the previous frame. An Acclaim clip is returned with Z, Y, X rotation channels on every joint.
  clip::Clip clip;
  int joints_changed = 0;
  double rms_change_rad = 0.0;  // motion::TurnSum: over frames and changed joints
  double max_change_rad = 0.0;
  std::optional<double> gate_mean{};      // over the frames; empty where there is no gate
  std::optional<double> estimate_mean{};  // of the style that it shows already, where known
  double max_root_offset_m = 0.0;         // of the root from the input's, by the feet stage
  double alpha = 0.0;                     // that arms allow of the one that was asked for
  bool kept_first = false;                // the first frame is an added rest pose, and stays
  bool hinge_held = false;                // knees or elbows were kept from bending backwards
  std::string remark{};                   // about joints that the skeleton lacks; may be empty
  std::string no_feet{};                  // why its feet do not stand; empty: they do
};

// The walker's own neutral pose and cadence by a warm-up over the whole clip
// (models/style/README.md, "Warm-up"). Returns the errors of apply_to_clip(), and one for a model
// without data for it and for a clip that shows no walk.
Result<Walker> measure_walker(const StyleModel& model, const std::string& model_name,
                              const clip::Clip& clip);

// Returns an error for a clip without frames or with a value that is not finite, and for a skeleton
// that lacks joints of the model or, where `feet` are needed, has no leg or no position channels;
// the error names what is missing. `model_name` is for errors.
Result<Applied> apply_to_clip(const StyleModel& model, const std::string& model_name,
                              const clip::Clip& clip, const ApplyOptions& options);

}  // namespace posed::style
