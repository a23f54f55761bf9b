// How many bytes have arrived through a TCP connection. In a file of its own because the kernel's
// header for it and the C library's <netinet/tcp.h> cannot be included together.
#pragma once

#include <cstdint>

namespace posed::net {

// Bytes received since the connection began, including those not read yet; 0 if `fd` is not a TCP
// connection (for example ipc).
[[nodiscard]] std::uint64_t received_bytes(int fd);

}  // namespace posed::net
