// Accepts devices that connect over TCP, and connects to systems that serve their data over TCP.
// TCP is not encrypted here, so without a list of peers posed listens on loopback only.
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <span>

#include "drivers/transport/address.hpp"
#include "drivers/transport/first_bytes.hpp"
#include "drivers/transport/socket.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {

namespace {

constexpr int kPatience_ms = 500;
constexpr int kBacklog = 8;
// Connections per call: an untrusted client may open them without end.
constexpr int kMaxAtOnce = 64;
constexpr std::size_t kMaxPausedConnections = 16;

Result<Address> address_of(const ListenSettings& settings) {
  return listen_address(settings.endpoint, settings.peers,
                        "the " + std::string(settings.device) + "s'");
}

// As far as what has come already tells, so that a page does not take the place of a device.
bool begins_like_a_browser(int fd) noexcept {
  std::array<std::byte, kMaxBeginning> bytes{};
  const ssize_t got = ::recv(fd, bytes.data(), bytes.size(), MSG_PEEK | MSG_DONTWAIT);
  return got > 0 &&
         beginning_of(std::span(bytes).first(static_cast<std::size_t>(got))) == Beginning::kBrowser;
}

// Meanwhile the device waits in the listener's queue and is accepted once a descriptor is free.
std::unexpected<Error> no_descriptor(const ListenSettings& settings) {
  return fail("a " + std::string(settings.device) + " has connected to " + settings.endpoint +
              ", but posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
}

bool hung_up(int fd) noexcept {
  std::byte next{};
  const ssize_t got = ::recv(fd, &next, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
}

}  // namespace

Result<> check_listen(const ListenSettings& settings) {
  TRY(Peers::parse(settings.peers));
  TRY(address_of(settings));
  return {};
}

std::optional<Connection> TransportFactory::first_waiting(Listener& listener) {
  auto& waiting = listener.waiting;
  std::erase_if(waiting, [](const Connection& link) { return hung_up(link.fd()); });
  const auto first = std::ranges::find_if(waiting, [](auto& link) { return !link.is_paused(); });
  if (first == waiting.end()) return std::nullopt;
  std::optional<Connection> link(std::move(*first));
  waiting.erase(first);
  return link;
}

Result<Connection> TransportFactory::accept(const ListenSettings& settings) {
  auto listener = listeners_.find(settings.endpoint);
  if (listener == listeners_.end()) {
    const auto address = TRY(address_of(settings));
    const auto fd = TRY(listen_on(address, settings.endpoint, kBacklog));
    listener = listeners_.emplace(settings.endpoint, Listener{.fd = fd}).first;
  }
  auto& [listening, waiting] = listener->second;
  if (only_prepare_) return not_opened();
  const auto peers = TRY(Peers::parse(settings.peers));
  std::array<pollfd, 2> wanted{{{.fd = listening, .events = POLLIN, .revents = 0},
                                {.fd = cancel_->fd(), .events = POLLIN, .revents = 0}}};
  ::poll(wanted.data(), wanted.size(), kPatience_ms);
  if (cancel_->fired()) return Cancel::error();
  // If several are waiting, the newest is used: a device that restarts leaves its old connection
  // behind.
  std::optional<Connection> newest;
  for (int i = 0; i < kMaxAtOnce; ++i) {
    Address peer;
    const int fd = ::accept4(listening, peer.get(), &peer.size, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0 && (errno == EINTR || errno == ECONNABORTED)) continue;
    if (fd < 0 && (errno == EMFILE || errno == ENFILE) && !newest) return no_descriptor(settings);
    if (fd < 0) break;
    const std::string host = host_text(peer);
    Connection link(fd, settings.endpoint + " from " + host, "tcp " + host);
    link.heed(cancel_);
    const Host from = host_of(peer);
    const bool paused = paused_->have(from);
    if (!peers.allow(from) || (paused && waiting.size() == kMaxPausedConnections) ||
        begins_like_a_browser(fd)) {
      ++refused_;
      continue;
    }
    link.came_through(listening, from, paused_);
    keep_alive(fd);
    if (paused) {
      waiting.push_back(std::move(link));
    } else {
      newest = std::move(link);
    }
  }
  if (!newest) newest = first_waiting(listener->second);
  std::size_t all = 0;
  for (const auto& [endpoint, one] : listeners_) all += one.waiting.size();
  paused_->waiting = all;
  if (newest) return std::move(*newest);
  return fail("no " + std::string(settings.device) + " has connected to " + settings.endpoint +
              " yet; give it this machine's address and switch it on");
}

namespace {

// The supervisor tries again; meanwhile a stop must not wait long.
constexpr int kConnectPatience_ms = 1000;

std::unexpected<Error> nothing_there(const std::string& endpoint, const std::string& why) {
  return fail("nothing answers at " + endpoint + " (" + why +
              "); start the streaming there, and check address, port and firewall");
}

}  // namespace

Result<> check_connect(const std::string& endpoint) {
  TRY(parse_endpoint(endpoint));
  return {};
}

Result<Connection> TransportFactory::connect(const std::string& endpoint) {
  const auto address = TRY(parse_endpoint(endpoint));
  if (only_prepare_) return not_opened();
  await_pause();
  const int fd = open_socket(address, SOCK_STREAM);
  if (fd < 0) {
    return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
  }
  Connection link(fd, endpoint, "tcp " + endpoint);
  link.came_through(-1, PausedHosts::kOurs, paused_);
  link.heed(cancel_);
  if (::connect(fd, address.get(), address.size) != 0) {
    if (errno != EINPROGRESS) return nothing_there(endpoint, errno_text());
    std::array<pollfd, 2> wanted{{{.fd = fd, .events = POLLOUT, .revents = 0},
                                  {.fd = cancel_->fd(), .events = POLLIN, .revents = 0}}};
    ::poll(wanted.data(), wanted.size(), kConnectPatience_ms);
    if (cancel_->fired()) return Cancel::error();
    if (wanted[0].revents == 0) return nothing_there(endpoint, "no reply");
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return nothing_there(endpoint, errno_text(error));
  }
  keep_alive(fd);
  return link;
}

}  // namespace posed::drivers
