// Angles are radians everywhere in the code; texts for people use degrees.
#pragma once

#include <numbers>

namespace posed {

inline constexpr double kDegree = std::numbers::pi / 180.0;  // [rad]

}  // namespace posed
