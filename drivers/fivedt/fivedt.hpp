// The driver of 5DT data gloves: serial with 5 or 16 sensors, Ultra Wireless, Ultra USB.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& fivedt_driver();

}  // namespace posed::drivers
