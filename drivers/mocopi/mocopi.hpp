// Driver for Sony mocopi: the phone app's motion stream over UDP.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& mocopi_driver();

}  // namespace posed::drivers
