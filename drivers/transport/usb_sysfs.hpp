// Reads from sysfs what is known about the USB device of a node. It needs no permission on the
// node, so a device that cannot be opened still has a name.
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/transport/enumerate.hpp"

namespace posed::drivers {

// Fills the USB part of `info` (ids, serial, port path, interface, name) from the device's
// directory or link below /sys; leaves it unchanged when no USB device is above. Cold.
void describe_usb(const std::filesystem::path& device, DeviceInfo& info);

// Why the node cannot be opened and how to fix it; empty when it can. Cold.
[[nodiscard]] std::string open_error_of(const std::string& node);

}  // namespace posed::drivers
