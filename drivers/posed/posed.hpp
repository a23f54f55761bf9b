// The stream of another daemon, or of a relay, as a device: machines chain.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& posed_driver();

}  // namespace posed::drivers
