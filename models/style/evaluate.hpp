// How near a styled clip comes to clips of the target style. Cold.
#pragma once

#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// All on the rotation vectors of every joint but the root, about the target's mean rotation.
struct StyleScore {
  double cycle_ratio =
      0.0;                  // rms of styled - target average cycle (28 phases) over source - target
  double ratio = 0.0;       // the same per frame against the target's cycle at the frame's phase
  double jerk_ratio = 0.0;  // rms third difference of styled over source
  // Per component of the rotation vectors, so not the angle of motion::TurnSum: styled - source of
  // the frames, and source - target of the average cycles, which is what 1.0 of cycle_ratio is.
  double component_rms_deg = 0.0;
  double source_component_rms_deg = 0.0;
  double source_period_s = 0.0, target_period_s = 0.0;
};

// `styled` is `source` after the filter: same skeleton names, rate and frames. Phases come from
// each clip's own thigh difference. Errors name the clip; a source that stands still or walks as
// the target does is one, because the ratios divide by what lies between them.
[[nodiscard]] Result<StyleScore> evaluate_style(const clip::Clip& source, const clip::Clip& styled,
                                                const clip::Clip& target);

}  // namespace posed::style
