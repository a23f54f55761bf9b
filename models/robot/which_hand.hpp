// The hands of a robot that has more than one hand: a body, a stand with two arms. Cold.
#pragma once

#include <optional>
#include <vector>

#include "models/robot/urdf.hpp"
#include "proto/frame/hand.hpp"

namespace posed::robot {

struct HandBelow {
  int above = 0;                // the first link that carries this hand alone, perhaps an arm's
  int palm = 0;                 // the last link that carries all its fingers
  std::optional<Side> named{};  // by "left", "right", "l_", "rh_" and the like in its links' names
};

// The largest parts of the tree with as many chains of joints as a hand has. None where all of the
// robot is such a part, or no part of it.
std::vector<HandBelow> hands_below(const std::vector<Link>& links);

}  // namespace posed::robot
