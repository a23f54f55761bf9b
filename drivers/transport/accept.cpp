// Accepts gloves that connect over TCP. TCP is not encrypted here, so without a list of peers posed
// listens on loopback only.
#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace {

constexpr int kPatience_ms = 500;
constexpr int kBacklog = 8;
// Connections per call: an untrusted client may open them without end.
constexpr int kMostAtOnce = 64;

struct Address {
  sockaddr_storage storage{};
  socklen_t size = sizeof(sockaddr_storage);

  [[nodiscard]] const sockaddr* get() const {
    return reinterpret_cast<const sockaddr*>(&storage);  // NOLINT: how sockets take addresses
  }
  [[nodiscard]] sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }  // NOLINT
};

std::string host_of(const Address& address) {
  std::array<char, NI_MAXHOST> host{};
  const int failed = ::getnameinfo(address.get(), address.size, host.data(), host.size(), nullptr,
                                   0, NI_NUMERICHOST);
  if (failed != 0) return "?";
  const std::string_view text(host.data());
  constexpr std::string_view kMapped = "::ffff:";  // an IPv4 peer of an IPv6 socket
  return std::string(text.starts_with(kMapped) ? text.substr(kMapped.size()) : text);
}

bool is_loopback(const std::string& host) { return host.starts_with("127.") || host == "::1"; }

// Parses "127.0.0.1:5200" or "[::1]:5200". Numbers only: a name may resolve differently tomorrow.
Result<Address> parse_endpoint(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  const auto wrong = [&] {
    return misuse("'" + endpoint + "' should be an address and a port, like 127.0.0.1:5200");
  };
  if (colon == std::string::npos || colon == 0) return wrong();
  std::string host = endpoint.substr(0, colon);
  const std::string port = endpoint.substr(colon + 1);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo wish{};
  wish.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  wish.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (port.empty() || ::getaddrinfo(host.c_str(), port.c_str(), &wish, &found) != 0) return wrong();
  Address address;
  std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
  address.size = found->ai_addrlen;
  ::freeaddrinfo(found);
  return address;
}

Result<Address> address_of(const ListenSettings& settings) {
  auto address = parse_endpoint(settings.endpoint);
  if (!address) return address;
  if (settings.peers.empty() && !is_loopback(host_of(*address))) {
    return misuse("to listen on " + settings.endpoint +
                  ", name the gloves' addresses in peers; without them only loopback listens");
  }
  return address;
}

Result<int> listen_at(const ListenSettings& settings) {
  const auto address = address_of(settings);
  if (!address) return std::unexpected(address.error());
  const int fd =
      ::socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  if (fd < 0 || ::bind(fd, address->get(), address->size) != 0 || ::listen(fd, kBacklog) != 0) {
    const int error = errno;
    if (fd >= 0) ::close(fd);
    return fail("cannot listen on " + settings.endpoint + " (" + std::strerror(error) +
                "); use an address of this machine and a port that is free");
  }
  return fd;
}

// A glove that loses its radio link sends nothing; keep-alive detects that within five seconds.
void make_prompt(int fd) {
  const int yes = 1, idle_s = 2, interval_s = 1, tries = 3;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
  ::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &yes, sizeof(yes));
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle_s, sizeof(idle_s));
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &interval_s, sizeof(interval_s));
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &tries, sizeof(tries));
}

// Meanwhile the glove waits in the listener's queue and is accepted once a descriptor is free.
std::unexpected<Error> no_descriptor(const ListenSettings& settings) {
  return fail("a glove has connected to " + settings.endpoint +
              ", but posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
}

bool may_connect(const std::string& host, const std::vector<std::string>& peers) {
  if (peers.empty()) return is_loopback(host);
  return std::ranges::find(peers, host) != peers.end();
}

}  // namespace

Result<> check_listen(const ListenSettings& settings) {
  if (const auto address = address_of(settings); !address) return std::unexpected(address.error());
  return {};
}

Result<Connection> TransportFactory::accept(const ListenSettings& settings) {
  auto listener = listeners_.find(settings.endpoint);
  if (listener == listeners_.end()) {
    const auto fd = listen_at(settings);
    if (!fd) return std::unexpected(fd.error());
    listener = listeners_.emplace(settings.endpoint, *fd).first;
  }
  if (only_prepare_) return not_opened();
  std::array<pollfd, 2> wanted{{{.fd = listener->second, .events = POLLIN, .revents = 0},
                                {.fd = cancel_->fd(), .events = POLLIN, .revents = 0}}};
  ::poll(wanted.data(), wanted.size(), kPatience_ms);
  if (cancel_->fired()) return Cancel::error();
  // If several are waiting, the newest is used: a glove that restarts leaves its old connection
  // behind.
  std::optional<Connection> newest;
  for (int i = 0; i < kMostAtOnce; ++i) {
    Address peer;
    const int fd =
        ::accept4(listener->second, peer.get(), &peer.size, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0 && (errno == EINTR || errno == ECONNABORTED)) continue;
    if (fd < 0 && (errno == EMFILE || errno == ENFILE) && !newest) return no_descriptor(settings);
    if (fd < 0) break;
    const std::string host = host_of(peer);
    Connection link(fd, settings.endpoint + " from " + host, "tcp " + host);
    link.heed(cancel_);
    if (!may_connect(host, settings.peers)) {
      ++refused_;
      continue;
    }
    make_prompt(fd);
    newest = std::move(link);
  }
  if (newest) return std::move(*newest);
  return fail("no glove has connected to " + settings.endpoint +
              " yet; give it this machine's address and switch it on");
}

}  // namespace posed::drivers
