// The file driver: a BVH or ASF/AMC clip or a hand CSV played as if it were a device.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& file_driver();

}  // namespace posed::drivers
