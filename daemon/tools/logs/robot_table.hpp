// What posed has derived from a URDF, as lines for people. Cold.
#pragma once

#include <string>
#include <vector>

#include "models/robot/robot_hand.hpp"

namespace posed::tools {

[[nodiscard]] std::vector<std::string> robot_table(const robot::RobotHand& hand);

}  // namespace posed::tools
