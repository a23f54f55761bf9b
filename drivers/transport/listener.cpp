#include "drivers/transport/listener.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace posed::drivers {

Result<int> listen_on(const Address& address, const std::string& endpoint, int backlog) {
  const int fd = ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  if (fd < 0 || ::bind(fd, address.get(), address.size) != 0 || ::listen(fd, backlog) != 0) {
    const int error = errno;
    if (fd >= 0) ::close(fd);
    return fail("cannot listen on " + endpoint + " (" + errno_text(error) +
                "); use an address of this machine and a port that is free");
  }
  return fd;
}

bool may_connect(const Address& peer, const std::vector<std::string>& peers) {
  if (peers.empty()) return is_loopback(host_of(peer));
  return std::ranges::find(peers, host_text(peer)) != peers.end();
}

}  // namespace posed::drivers
