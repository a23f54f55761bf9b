// Connects to a system that serves its data over TCP.
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>

#include "drivers/transport/address.hpp"
#include "drivers/transport/keep_alive.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace {

// The supervisor tries again; meanwhile a stop must not wait long.
constexpr int kConnectPatience_ms = 1000;

std::unexpected<Error> nothing_there(const std::string& endpoint, const std::string& why) {
  return fail("nothing answers at " + endpoint + " (" + why +
              "); start the streaming there, and check address, port and firewall");
}

}  // namespace

Result<> check_connect(const std::string& endpoint) {
  if (const auto address = parse_endpoint(endpoint); !address) {
    return std::unexpected(address.error());
  }
  return {};
}

Result<Connection> TransportFactory::connect(const std::string& endpoint) {
  const auto address = parse_endpoint(endpoint);
  if (!address) return std::unexpected(address.error());
  if (only_prepare_) return not_opened();
  const int fd =
      ::socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) {
    return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
  }
  Connection link(fd, endpoint, "tcp " + endpoint);
  link.heed(cancel_);
  if (::connect(fd, address->get(), address->size) != 0) {
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
