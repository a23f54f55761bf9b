#include "drivers/transport/address.hpp"

#include <netdb.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>

#include "proto/text/number.hpp"

namespace posed::drivers {
namespace {

constexpr Host kMapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
constexpr std::size_t kMappedBytes = 12;
constexpr Host kLoopback6{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};

bool is_v4(const Host& host) noexcept {
  return std::equal(kMapped.begin(), kMapped.begin() + kMappedBytes, host.begin());
}

// The C library would take "-1" for 65535, and 65536 for 0.
bool is_port(std::string_view text) noexcept {
  return exact_number<std::uint16_t>(text).has_value();
}

std::optional<Address> first_address(const std::string& host, const char* port, int flags,
                                     int family) {
  addrinfo wish{};
  wish.ai_flags = flags;
  wish.ai_family = family;
  wish.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), port, &wish, &found) != 0) return std::nullopt;
  Address address;
  std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
  address.size = found->ai_addrlen;
  ::freeaddrinfo(found);
  return address;
}

// As RFC 1123 allows them, with a letter, so that no number is asked of a name server.
bool is_host_name(std::string_view text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  constexpr std::size_t kMaxHostName = 253;
  return text.size() <= kMaxHostName && std::ranges::any_of(text, is_letter) &&
         std::ranges::all_of(text, [&](char c) {
           return is_letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.';
         });
}

// What was asked so far; a name without an address is not asked again either.
struct Names {
  std::mutex mutex;
  Resolver resolver = nullptr;
  std::map<std::string, std::optional<Address>> asked;
};

Names& names() {
  static Names instance;
  return instance;
}

std::optional<Address> find_name(const std::string& name) {
  Names& all = names();
  const std::scoped_lock lock(all.mutex);
  if (all.resolver == nullptr || !is_host_name(name)) return std::nullopt;
  const auto [at, is_new] = all.asked.try_emplace(name);
  if (is_new) at->second = all.resolver(name);
  return at->second;
}

void set_port(Address& address, const char* port) {
  const std::uint16_t network_order = htons(static_cast<std::uint16_t>(std::atoi(port)));
  std::memcpy(reinterpret_cast<char*>(&address.storage) + 2, &network_order, sizeof network_order);
}

std::optional<Address> find_address(const std::string& host, const char* port) {
  if (port != nullptr && !is_port(port)) return std::nullopt;
  constexpr int kNumbers = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  if (const auto numbers = first_address(host, port, kNumbers, AF_UNSPEC)) return numbers;
  auto named = find_name(host);
  if (named && port != nullptr) set_port(*named, port);
  return named;
}

}  // namespace

RT_SAFE std::uint16_t port_of(const Address& address) noexcept {
  std::uint16_t port = 0;  // at the same place for IPv4 and IPv6
  std::memcpy(&port, reinterpret_cast<const char*>(&address.storage) + 2, sizeof port);
  return ntohs(port);
}

RT_SAFE Host host_of(const Address& address) noexcept {
  Host host{};
  if (address.storage.ss_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &address.storage, sizeof v6);
    std::memcpy(host.data(), &v6.sin6_addr, host.size());
  } else {
    sockaddr_in v4{};
    std::memcpy(&v4, &address.storage, sizeof v4);
    host = kMapped;
    std::memcpy(host.data() + kMappedBytes, &v4.sin_addr, sizeof v4.sin_addr);
  }
  return host;
}

RT_SAFE bool is_loopback(const Host& host) noexcept {
  return is_v4(host) ? host[kMappedBytes] == 127 : host == kLoopback6;
}

Address ipv4_address(std::uint32_t numbers) noexcept {
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_addr.s_addr = htonl(numbers);
  Address address;
  std::memcpy(&address.storage, &v4, sizeof v4);
  address.size = sizeof v4;
  return address;
}

bool is_multicast(const Host& host) noexcept {
  return is_v4(host) ? host[kMappedBytes] >> 4 == 14 : host[0] == 0xFF;
}

// On Linux the socket of [::] has IPv4's addresses, too.
bool overlap(const Address& a, const Address& b) {
  const Host host_a = host_of(a);
  const Host host_b = host_of(b);
  const auto covers = [](const Host& all, const Host& one) {
    return all == Host{} || (all == kMapped && is_v4(one));
  };
  return port_of(a) == port_of(b) &&
         (host_a == host_b || covers(host_a, host_b) || covers(host_b, host_a));
}

std::string host_text(const Address& address) {
  std::array<char, NI_MAXHOST> host{};
  const int failed = ::getnameinfo(address.get(), address.size, host.data(), host.size(), nullptr,
                                   0, NI_NUMERICHOST);
  if (failed != 0) return "?";
  const std::string_view text(host.data());
  constexpr std::string_view kMappedText = "::ffff:";  // an IPv4 peer of an IPv6 socket
  return std::string(text.starts_with(kMappedText) ? text.substr(kMappedText.size()) : text);
}

std::string endpoint_text(const Address& address) {
  const std::string host = host_text(address);
  const bool v6 = host.contains(':');
  return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port_of(address));
}

Result<Address> parse_endpoint(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  const bool split = colon != std::string::npos && colon != 0 && colon + 1 < endpoint.size();
  std::string host = split ? endpoint.substr(0, colon) : "";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const auto address =
      split ? find_address(host, endpoint.c_str() + colon + 1) : std::optional<Address>();
  if (address) return *address;
  return misuse("'" + endpoint +
                "' should be an address and a port, like 127.0.0.1:5200, or the "
                "name of a computer that this one knows and a port");
}

Result<Address> parse_host(const std::string& host) {
  // An empty text would mean any address.
  const auto address = host.empty() ? std::optional<Address>() : find_address(host, nullptr);
  if (address) return *address;
  return misuse("'" + host +
                "' should be an address in numbers, like 192.168.1.20, or the name "
                "of a computer that this one knows");
}

std::optional<Address> look_up(const std::string& name) {
  if (const auto v4 = first_address(name, nullptr, 0, AF_INET)) return v4;
  return first_address(name, nullptr, 0, AF_INET6);
}

void use_resolver(Resolver resolver) {
  Names& all = names();
  const std::scoped_lock lock(all.mutex);
  all.resolver = resolver;
  all.asked.clear();
}

std::vector<std::pair<std::string, std::string>> resolved_names() {
  Names& all = names();
  const std::scoped_lock lock(all.mutex);
  std::vector<std::pair<std::string, std::string>> found;
  for (const auto& [name, address] : all.asked) {
    if (address) found.emplace_back(name, host_text(*address));
  }
  return found;
}

Result<Peers> Peers::parse(const std::vector<std::string>& hosts) {
  Peers peers;
  for (const std::string& text : hosts) {
    const auto host = TRY(parse_host(text));
    peers.hosts_.push_back(host_of(host));
  }
  return peers;
}

RT_SAFE bool Peers::allow(const Host& host) const noexcept {
  if (hosts_.empty()) return is_loopback(host);
  return std::ranges::find(hosts_, host) != hosts_.end();
}

Result<Address> listen_address(const std::string& endpoint, const std::vector<std::string>& peers,
                               std::string_view whose) {
  auto address = TRY(parse_endpoint(endpoint));
  if (peers.empty() && !is_loopback(host_of(address))) {
    return misuse("to listen on " + endpoint + ", name " + std::string(whose) +
                  " addresses in peers; without them only loopback listens");
  }
  return address;
}

}  // namespace posed::drivers
