// The driver for OptiTrack systems: Motive and other programs that speak NatNet.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& natnet_driver();

}  // namespace posed::drivers
