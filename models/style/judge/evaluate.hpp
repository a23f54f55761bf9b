// How close a styled clip is to clips of the target style (models/style/README.md, "Evaluation").
// Cold.
#pragma once

#include <optional>

#include "models/motion/pose_space.hpp"
#include "models/style/judge/body_cycle.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// All on the components of the pose vector that do not belong to the root: rotation vectors about
// the target's mean rotation, or the angles of cmu43.
struct StyleScore {
  double cycle_ratio =
      0.0;                  // rms of styled - target average cycle (28 phases) over source - target
  double ratio = 0.0;       // the same per frame against the target's cycle at the frame's phase
  double jerk_ratio = 0.0;  // rms third difference of styled over source
  // Rms per component of the rotation vectors, hence not the angle of motion::TurnSum: styled -
  // source of the frames, and source - target of the average cycles, which corresponds to a
  // cycle_ratio of 1.
  double component_rms_deg = 0.0;
  double source_component_rms_deg = 0.0;
  double source_period_s = 0.0, target_period_s = 0.0;
  // Scores of the feet (models/feet/foot_score.hpp); empty where nothing stands or there are no
  // legs.
  struct Clips {
    std::optional<double> source{}, styled{}, target{};
  };
  Clips slide_m_s;                   // of standing feet
  Clips root_speed_m_s;              // over the ground
  std::optional<double> sink_m{};    // of the toes
  std::optional<BodyErrors> body{};  // empty without legs
};

// `styled` is `source` after the filter, with the same skeleton names, rate and frames. Phases come
// from each clip's own leg signal. Errors name the clip. A source that stands still or that walks
// like the target is an error, because the ratios divide by the difference between source and
// target. The poses are compared in `space`, the model's own; in the native space over all joints
// of the target, which the source must have. The error names the joints that a clip lacks.
Result<StyleScore> evaluate_style(const clip::Clip& source, const clip::Clip& styled,
                                  const clip::Clip& target,
                                  const motion::PoseSpaceSpec& space = {});

}  // namespace posed::style
