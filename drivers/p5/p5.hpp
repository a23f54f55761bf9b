// The driver of the Essential Reality P5, a USB glove, over libusb.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& p5_driver();

}  // namespace posed::drivers
