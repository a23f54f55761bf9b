// The cyberglove driver: CyberGlove I, II and III over a serial port, and III over Wi-Fi.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& cyberglove_driver();

}  // namespace posed::drivers
