// Driver for Rokoko Studio: suits, gloves, faces and props over UDP, as its custom live stream
// sends them.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& rokoko_driver();

}  // namespace posed::drivers
