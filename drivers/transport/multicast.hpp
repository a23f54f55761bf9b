// Joins a socket to a multicast group on one network interface.
#pragma once

#include <string>

#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

// `interface` is its name ("eth0") or one of its addresses; empty: the system's choice. From other
// groups that this machine has joined the socket then receives nothing. Cold.
[[nodiscard]] Result<> join_group(int fd, const Address& group, const std::string& interface);

}  // namespace posed::drivers
