// The described driver: a device that a TOML file describes (device_file.hpp), without code.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& described_driver();

}  // namespace posed::drivers
