// A performance on a body: the skeleton, the place and the heading of a clip's first frame, moved
// as a model of bodies performs (models/perform/README.md, "Bodies"). Cold.
#pragma once

#include "models/gesture/gesture_model.hpp"
#include "models/perform/perform.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::perform {

struct BodyPerformance {
  clip::Clip clip;
  double feet_off_m = 0.0;  // farthest that a foot gets from its place in the first frame
};

// Joints that are not in the model stay as they are in `body`'s first frame. The root moves so that
// the feet stand: their middle stays where it is in that frame. Returns an error for a model of
// hands and for a body that lacks joints of the model.
[[nodiscard]] Result<BodyPerformance> perform_on(const gesture::GestureModel& model,
                                                 const Performance& performance,
                                                 const clip::Clip& body);

}  // namespace posed::perform
