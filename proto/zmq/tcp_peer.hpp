// What the kernel knows of a TCP connection that libzmq has made or accepted. A file of its own,
// because the kernel's header for it and the C library's <netinet/tcp.h> cannot be included
// together. Cold.
#pragma once

#include <cstdint>

namespace posed::net {

// How many bytes of data have arrived at this TCP connection; 0 for any other descriptor.
[[nodiscard]] std::uint64_t received_bytes(int fd);

// The kernel's id of the connection, because descriptors are reused; 0 if there is none.
[[nodiscard]] std::uint64_t cookie_of(int fd);

}  // namespace posed::net
