// Inside is radians; people read degrees.
#pragma once

#include <numbers>

namespace posed::cli {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;  // in a radian

}  // namespace posed::cli
