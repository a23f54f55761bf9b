// How much has come in through a TCP connection. A file of its own: the kernel's header that knows
// and the C library's <netinet/tcp.h> cannot be included together.
#pragma once

#include <cstdint>

namespace posed::net {

// Bytes received since the connection began, those not read yet included; 0 when `fd` is no TCP
// connection (ipc).
[[nodiscard]] std::uint64_t received_bytes(int fd);

}  // namespace posed::net
