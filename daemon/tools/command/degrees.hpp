// The program computes in radians; the user interface shows degrees.
#pragma once

#include "proto/frame/degree.hpp"

namespace posed::tools {

inline constexpr double kDegrees = 1.0 / kDegree;  // degrees in a radian

}  // namespace posed::tools
