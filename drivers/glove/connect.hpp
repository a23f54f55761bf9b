// Connections to gloves that send a byte stream: the options that all such drivers share, and the
// link that these options select.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/driver_of.hpp"
#include "drivers/known_usb.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

// The options port, id, hand and baud.
[[nodiscard]] std::vector<OptionSpec> serial_options(std::int64_t baud);
// The options link, listen and peers, for gloves that can also connect over TCP.
[[nodiscard]] std::vector<OptionSpec> tcp_options(std::string_view listen);

// Reads the hand from completed options. Cold.
Result<Side> hand_option(const Options& options);

// Checks that connect() could use these completed options, without opening anything. A driver's
// expect() calls it, so that invalid options are an error before a glove is connected. Cold.
Result<> check_connection(const Options& options);

// Opens the link that completed options select; without port and id, the one whose USB id is in
// `usb` (vendor_id << 16 | product_id). Cold: may wait half a second for a glove that connects to
// posed.
Result<Connection> connect(const Options& options, TransportFactory& ports,
                           std::vector<std::uint32_t> usb);
Result<Connection> connect(const Options& options, TransportFactory& ports,
                           std::span<const KnownUsb> usb);

// A glove that streams is reopened when it has been silent for so long.
inline constexpr double kLineSilence_s = 2.0;

// Waits a few seconds at most for a line that `is_line` accepts, because a board that restarts when
// its port opens sends other text first. An error says what came instead. The link is left at the
// end of a line if possible. Cold.
Result<> await_line(Connection& link, const std::function<bool(std::string_view)>& is_line);

// The result of a Type's open() for a glove on this link (drivers/driver_of.hpp).
[[nodiscard]] Opened opened(Connection link, double reopen_after_s);

}  // namespace posed::drivers::glove
