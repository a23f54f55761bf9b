// The program computes in radians; the user interface shows degrees.
#pragma once

#include <numbers>

namespace posed::cli {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;  // degrees in a radian

}  // namespace posed::cli
