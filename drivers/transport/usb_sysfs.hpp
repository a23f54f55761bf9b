// What sysfs says of the USB device behind a node. It needs no permission on the node, so a device
// that cannot be opened is still named.
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/transport/enumerate.hpp"

namespace posed::drivers {

// Fills the USB part of `info` (ids, serial, port path, interface, name) from the device's
// directory or link below /sys; leaves it when there is no USB device above. Cold.
void describe_usb(const std::filesystem::path& device, DeviceInfo& info);

// Why the node cannot be opened and what mends it; empty when it can. Cold.
[[nodiscard]] std::string open_error_of(const std::string& node);

}  // namespace posed::drivers
