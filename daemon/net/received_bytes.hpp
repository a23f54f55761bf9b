// Counts the bytes that have arrived through a TCP connection. This is a file of its own because
// the kernel's header for it and the C library's <netinet/tcp.h> cannot be included together.
#pragma once

#include <cstdint>

namespace posed::net {

// Returns the bytes received since the connection began, including those not read yet; 0 if `fd` is
// not a TCP connection (for example ipc).
[[nodiscard]] std::uint64_t received_bytes(int fd);

}  // namespace posed::net
