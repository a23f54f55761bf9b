// Connections to gloves that send a byte stream: the options that all such drivers share, and the
// link that these options select.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

// The options port, id, hand and baud.
[[nodiscard]] std::vector<OptionSpec> serial_options(std::int64_t baud);
// The options link, listen and peers, for gloves that can also connect over TCP.
[[nodiscard]] std::vector<OptionSpec> tcp_options(std::string_view listen);

// Takes options that complete_options() has completed. Cold.
[[nodiscard]] Result<Side> hand_option(const Options& options);

// Checks that connect() could use these completed options, without opening anything. A driver's
// expect() calls it, so that invalid options are an error before a glove is connected. Cold.
[[nodiscard]] Result<> check_connection(const Options& options);

// Opens the link that completed options select; without port and id, the one whose USB id is in
// `usb_ids` (vendor_id << 16 | product_id). Cold: may wait half a second for a glove that connects
// to posed.
[[nodiscard]] Result<Connection> connect(const Options& options, TransportFactory& ports,
                                         std::vector<std::uint32_t> usb_ids);

}  // namespace posed::drivers::glove
