// A driver's options as people type them: KEY=VALUE.
#pragma once

#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::cli {

// Completed with the driver's defaults; a key or a value that it does not take is misuse.
[[nodiscard]] Result<drivers::Options> parse_driver_options(const drivers::Driver& driver,
                                                            const std::vector<std::string>& words);

}  // namespace posed::cli
