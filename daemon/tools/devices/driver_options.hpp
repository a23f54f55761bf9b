// Driver options from the command line: KEY=VALUE.
#pragma once

#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// Completed with the driver's defaults; an unknown key or a wrong value is an error (wrong use).
Result<drivers::Options> parse_driver_options(const drivers::Driver& driver,
                                              const std::vector<std::string>& words);

}  // namespace posed::tools
