// Network sockets: one way to open them for drivers, outputs and emulated devices. TCP is not
// encrypted here, so without a list of peers only those of this machine are let in. Cold.
#pragma once

#include <sys/socket.h>

#include <string>

#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

// Opens a socket (SOCK_DGRAM or SOCK_STREAM) for addresses like this one. It does not block and is
// not inherited; the caller closes it. -1: see errno.
[[nodiscard]] int open_socket(const Address& address, int kind) noexcept;

// Opens such a socket and binds it to the address. `shared`: other sockets may have the address,
// too (a multicast group), or had it a moment ago (TCP).
[[nodiscard]] int bind_socket(const Address& address, int kind, bool shared) noexcept;

// Returns the address that the socket is bound to.
[[nodiscard]] Address bound_address(int fd) noexcept;

// Binds a TCP socket and lets it listen. `endpoint` is the address for sentences.
Result<int> listen_on(const Address& address, const std::string& endpoint, int backlog);

// Sets a TCP connection to a device up: small packets are sent at once, and a device that has lost
// its network, which sends nothing, is noticed within five seconds.
void keep_alive(int fd) noexcept;

}  // namespace posed::drivers
