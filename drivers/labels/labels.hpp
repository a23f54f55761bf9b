// A stream without a device: a hand or a body that performs gesture labels only.
#pragma once

#include "drivers/driver.hpp"

namespace posed::drivers {

[[nodiscard]] const Driver& labels_driver();

}  // namespace posed::drivers
