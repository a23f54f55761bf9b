// The VMC driver: a performer that sends its avatar's bones, blend shapes and trackers as OSC over
// UDP, as virtual-avatar programs do.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& vmc_driver();

}  // namespace posed::drivers
