// How a glove with a byte stream is reached: the options that all such drivers share, and the link
// they lead to.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/connection.hpp"

namespace posed::drivers::glove {

// port, id, hand and baud.
[[nodiscard]] std::vector<OptionSpec> serial_options(std::int64_t baud);
// link, listen and peers, for gloves that may come over TCP, too.
[[nodiscard]] std::vector<OptionSpec> tcp_options(std::string_view listen);

// Of completed options. Cold.
[[nodiscard]] Result<Side> hand_option(const Options& options);

// Whether connect() could do with these completed options, without opening anything: what a
// driver's expect() asks, so that options that make no sense are refused before a glove is there.
// Cold.
[[nodiscard]] Result<> check_connection(const Options& options);

// The link that completed options lead to; without port and id one of `usb_ids`
// (vendor << 16 | product). Cold: may wait half a second for a glove that connects to us.
[[nodiscard]] Result<Connection> connect(const Options& options, TransportFactory& ports,
                                         std::vector<std::uint32_t> usb_ids);

}  // namespace posed::drivers::glove
