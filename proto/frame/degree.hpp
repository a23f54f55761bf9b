// Angles are radians everywhere; texts that people write and read have degrees.
#pragma once

#include <numbers>

namespace posed {

inline constexpr double kDegree = std::numbers::pi / 180.0;  // [rad]

}  // namespace posed
