// Network addresses of devices, in numbers or by the name of a computer. Shared by TCP and UDP.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
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

// Parses "127.0.0.1:5200", "[::1]:5200" or "localhost:5200". Cold.
Result<Address> parse_endpoint(const std::string& endpoint);

// Parses "127.0.0.1", "::1" or "localhost"; the port is 0. Cold.
Result<Address> parse_host(const std::string& host);

// Finds the address of a computer by its name; the port is 0. May wait for the network.
using Resolver = std::optional<Address> (*)(const std::string& name);
// The system's: its file of hosts, then its name servers. It prefers IPv4, which more capture
// systems speak.
[[nodiscard]] std::optional<Address> look_up(const std::string& name);

// From now on names are asked of `resolver`, each one once in the life of the process, so that
// whoever is named does not change while it runs. Null, as at the beginning: only numbers are
// addresses, and nothing is asked. Cold; any thread.
void use_resolver(Resolver resolver);
// The names that were found so far with their addresses: {"motive-pc.local", "192.168.1.20"}. Cold.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> resolved_names();

// Who may send or connect.
class Peers {
 public:
  Peers() = default;  // this machine only
  // An empty list names this machine.
  static Result<Peers> parse(const std::vector<std::string>& hosts);

  RT_SAFE [[nodiscard]] bool allow(const Host& host) const noexcept;

 private:
  std::vector<Host> hosts_;
};

// The address to listen on. Devices are not authenticated, so without a list of peers it must be
// loopback; `whose` ("the gloves'") says whose addresses belong there. Cold.
Result<Address> listen_address(const std::string& endpoint, const std::vector<std::string>& peers,
                               std::string_view whose);

}  // namespace posed::drivers
