#include "drivers/transport/socket.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <unistd.h>

#include <cerrno>

namespace posed::drivers {

int open_socket(const Address& address, int kind) noexcept {
  return ::socket(address.storage.ss_family, kind | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

int bind_socket(const Address& address, int kind, bool shared) noexcept {
  const int fd = open_socket(address, kind);
  if (fd < 0) return fd;
  const int yes = 1;
  if (shared) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(fd, address.get(), address.size) == 0) return fd;
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

Address bound_address(int fd) noexcept {
  Address address;
  ::getsockname(fd, address.get(), &address.size);
  return address;
}

Result<int> listen_on(const Address& address, const std::string& endpoint, int backlog) {
  const int fd = bind_socket(address, SOCK_STREAM, true);
  if (fd >= 0 && ::listen(fd, backlog) == 0) return fd;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  return fail("cannot listen on " + endpoint + " (" + errno_text(error) +
              "); use an address of this machine and a port that is free");
}

void keep_alive(int fd) noexcept {
  const int yes = 1, idle_s = 2, interval_s = 1, tries = 3;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  ::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &yes, sizeof yes);
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle_s, sizeof idle_s);
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &interval_s, sizeof interval_s);
  ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &tries, sizeof tries);
}

}  // namespace posed::drivers
