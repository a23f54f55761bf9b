// Builds the Device that a driver's open() returns.
#pragma once

#include <string>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Makes description and decoder from `text` (Description::text) with the driver's own describe()
// and make_decoder(), so that a live stream uses exactly what a log rebuilds. open() adds the
// transport and anything else. Cold.
[[nodiscard]] Result<Device> make_device(const Driver& driver, const std::string& text,
                                         const std::string& identity);

}  // namespace posed::drivers
