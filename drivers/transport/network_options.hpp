// The options of mocap systems over UDP, and of those that send the same bytes over UDP or TCP.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp.hpp"

namespace posed::drivers {

// The options listen, group, interface and peers.
[[nodiscard]] std::vector<OptionSpec> udp_options(std::string_view listen);
// The settings of a device with one socket, from completed options.
[[nodiscard]] UdpSettings udp_settings(const Options& options);

// Those of udp_options(), and link ("udp" or "tcp", `link` by default) and connect.
[[nodiscard]] std::vector<OptionSpec> network_options(std::string_view link,
                                                      std::string_view listen);

// Checks completed options without opening anything. Cold.
Result<> check_network(const Options& options);

// Says where the bytes come from, for people and for the log: "udp 127.0.0.1:9763". Cold.
[[nodiscard]] std::string network_identity(const Options& options);

// Opens what completed options describe. Cold.
Result<std::unique_ptr<Transport>> open_network(const Options& options, TransportFactory& ports);

}  // namespace posed::drivers
