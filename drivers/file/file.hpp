// The file driver: a clip of any format that posed reads, played as if it were a device.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& file_driver();

}  // namespace posed::drivers
