// Axis Neuron, Axis Neuron Pro and Axis Studio, the applications of the Perception Neuron suits:
// their BVH motion streams, binary or text, over TCP or UDP.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& axis_driver();

}  // namespace posed::drivers
