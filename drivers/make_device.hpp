// The Device that a driver's open() returns, begun from what the device said.
#pragma once

#include <string>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Description and decoder out of `text` (Description::text), by the driver's own describe() and
// make_decoder(): so what plays live is what a log rebuilds. The transport and whatever else the
// device needs are left to open(). Cold.
[[nodiscard]] Result<Device> make_device(const Driver& driver, const std::string& text,
                                         const std::string& identity);

}  // namespace posed::drivers
