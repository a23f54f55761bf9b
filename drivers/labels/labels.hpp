// A stream without a device: a hand that only performs labels.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& labels_driver();

}  // namespace posed::drivers
