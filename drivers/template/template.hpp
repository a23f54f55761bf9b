// The template driver: what a device needs to become a stream, on one small invented device. Copy
// this folder to begin a driver; drivers/README.md goes through it step by step.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& template_driver();

}  // namespace posed::drivers
