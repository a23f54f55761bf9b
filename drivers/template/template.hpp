// The template driver: everything that a device needs to become a stream, shown on a small invented
// device. Copy this folder to begin a driver; drivers/README.md explains the steps.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& template_driver();

}  // namespace posed::drivers
