// A drawn thumbnail of a style: its mean cycle as stick figures beside each other, seen from the
// side. Any thread; cold.
#pragma once

#include <string>

#include "models/style/model/style_model.hpp"

namespace posed::control {

// The size of the drawing, in centimetres of an average person: a client's viewBox.
inline constexpr int kStripPoses = 6;
inline constexpr int kStripPose_cm = 95;  // the room of a pose
inline constexpr int kStripHeight_cm = 185;

// What the `d` of an SVG path has: only M, L, digits, '-' and blanks; walking to the right, the
// ground below. Empty for a model that knows no cycle, or whose joints are a device's own, of which
// the model does not say how long the bones are.
[[nodiscard]] std::string strip_of(const style::StyleModel& model);

}  // namespace posed::control
