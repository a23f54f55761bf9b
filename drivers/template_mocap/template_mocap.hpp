// The template mocap driver: everything that a device with several bodies needs, shown on a small
// invented system over UDP. Copy this folder to begin a driver; drivers/README.md explains the
// steps.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& template_mocap_driver();

}  // namespace posed::drivers
