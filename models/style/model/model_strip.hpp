// A drawn thumbnail of a style: its mean cycle as stick figures beside each other, seen from the
// side. Any thread; cold.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "models/style/model/style_model.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {

// The size of the drawing, in centimetres of an average person: a client's viewBox.
inline constexpr int kStripPoses = 6;
inline constexpr int kStripPose_cm = 95;  // the room of a pose
inline constexpr int kStripHeight_cm = 185;

// What the `d` of an SVG path has: only M, L, digits, '-' and blanks; walking to the right, the
// ground below. A model of a skeleton's own joints does not say how long the bones are: it is drawn
// on the first of `known` that it was trained on, or on that of the demo's walkers. Empty where
// none is, and for a model that knows no cycle.
[[nodiscard]] std::string strip_of(const StyleModel& model,
                                   std::span<const std::shared_ptr<const Skeleton>> known = {});

}  // namespace posed::style
