// Builds the Device that a driver's open() returns.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Makes description and decoder from `text` (Description::text) with the driver's own describe()
// and make_decoder(), so that a live stream uses exactly what a log rebuilds. open() adds the
// transport and anything else. Cold.
[[nodiscard]] Result<Device> make_device(const Driver& driver, const std::string& text,
                                         const std::string& identity);
// The same for what expect() has described, with its transport. Cold.
[[nodiscard]] Result<Device> make_device(const Driver& driver, const Description& expected,
                                         std::unique_ptr<Transport> transport);

// Of a device whose bodies come later: it has no skeleton and no samples of its own. Cold.
[[nodiscard]] Description source_description(std::string_view driver, const std::string& text,
                                             const std::string& identity, double rate_hz);

}  // namespace posed::drivers
