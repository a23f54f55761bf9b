// The driver named `described` is table-driven: a TOML file (device_file.hpp) describes the device;
// no code is needed.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& described_driver();

}  // namespace posed::drivers
