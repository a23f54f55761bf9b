// Network addresses of devices: parsed from numbers only, because a name may resolve differently
// tomorrow. Shared by TCP and UDP.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::drivers {

// An address with its port, in the form that sockets use.
struct Address {
  sockaddr_storage storage{};
  socklen_t size = sizeof(sockaddr_storage);

  [[nodiscard]] const sockaddr* get() const noexcept {
    return reinterpret_cast<const sockaddr*>(&storage);  // NOLINT: how sockets take addresses
  }
  [[nodiscard]] sockaddr* get() noexcept {
    return reinterpret_cast<sockaddr*>(&storage);  // NOLINT: how sockets take addresses
  }
};

// An address without its port; an IPv4 one in the form ::ffff:1.2.3.4, so that a peer of an IPv6
// socket compares equal to itself.
using Host = std::array<std::uint8_t, 16>;

RT_SAFE [[nodiscard]] std::uint16_t port_of(const Address& address) noexcept;
RT_SAFE [[nodiscard]] Host host_of(const Address& address) noexcept;
RT_SAFE [[nodiscard]] bool is_loopback(const Host& host) noexcept;
[[nodiscard]] bool is_multicast(const Host& host) noexcept;
// Returns whether a socket bound to one address keeps others from the other: the same port, and the
// same host or one that stands for every address of the machine. Cold.
[[nodiscard]] bool overlap(const Address& a, const Address& b);
[[nodiscard]] std::string host_text(const Address& address);  // "192.168.1.20"
[[nodiscard]] std::string endpoint_text(
    const Address& address);  // "192.168.1.20:1511", "[::1]:1511"

// The IPv4 address with the first number in the highest byte; the port is 0.
[[nodiscard]] Address ipv4_address(std::uint32_t numbers) noexcept;

// Parses "127.0.0.1:5200" or "[::1]:5200". Cold.
Result<Address> parse_endpoint(const std::string& endpoint);

// Parses "127.0.0.1" or "::1"; the port is 0. Cold.
Result<Address> parse_host(const std::string& host);

// The address to listen on. Devices are not authenticated, so without a list of peers it must be
// loopback; `whose` ("the gloves'") says whose addresses belong there. Cold.
Result<Address> listen_address(const std::string& endpoint, const std::vector<std::string>& peers,
                               std::string_view whose);

}  // namespace posed::drivers
