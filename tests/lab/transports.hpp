// The transports against the kernel's own USB: each device is unplugged and plugged in again while
// it streams.
#pragma once

#include <string_view>

#include "tests/lab/devices.hpp"

namespace posed::lab {

// Prints a line a device (all, or the one of that name); the number of devices that failed.
int check_transports(const LabDevices& devices, std::string_view only);

}  // namespace posed::lab
