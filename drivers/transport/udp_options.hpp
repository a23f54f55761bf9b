// The options that all devices over UDP share.
#pragma once

#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/udp.hpp"

namespace posed::drivers {

// The options listen, group, interface and peers.
[[nodiscard]] std::vector<OptionSpec> udp_options(std::string_view listen);

// Of a device with one socket, from completed options.
[[nodiscard]] UdpSettings udp_settings(const Options& options);

}  // namespace posed::drivers
