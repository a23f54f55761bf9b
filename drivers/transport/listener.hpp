// Listening for TCP connections, which are not encrypted: so without a list of peers only those of
// this machine are let in.
#pragma once

#include <string>
#include <vector>

#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

// A socket that listens and does not block, for the caller to close. `endpoint` is the address for
// sentences. Cold.
[[nodiscard]] Result<int> listen_on(const Address& address, const std::string& endpoint,
                                    int backlog);

// Whether the list names the peer's address; an empty list names this machine.
[[nodiscard]] bool may_connect(const Address& peer, const std::vector<std::string>& peers);

}  // namespace posed::drivers
