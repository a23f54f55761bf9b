// Checks the transports with the kernel's own USB stack: each device is unplugged and plugged in
// again while it streams.
#pragma once

#include <string_view>

#include "tests/lab/devices.hpp"

namespace posed::lab {

// Prints one line per device (all, or the one named `only`) and returns the number that failed.
int check_transports(const LabDevices& devices, std::string_view only);

}  // namespace posed::lab
