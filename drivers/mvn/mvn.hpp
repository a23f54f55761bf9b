// The driver of Xsens MVN (Movella): the poses of several people as its Network Streamer sends them
// over UDP or TCP. The README of this folder states what is proven and how.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& mvn_driver();

}  // namespace posed::drivers
