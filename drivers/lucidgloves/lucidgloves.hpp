// The driver of LucidGloves and other gloves that speak OpenGloves, over a serial port or TCP.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& lucidgloves_driver();

}  // namespace posed::drivers
