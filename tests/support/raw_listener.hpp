// RawListener: listens on a loopback port and sends whoever connects any bytes: the one who has a
// daemon's port while the daemon is away.
#pragma once

#include <stdexcept>
#include <string>

#include "tests/support/raw_peer.hpp"

namespace posed::test {

inline std::string repeated(const std::string& bytes, std::size_t at_least) {
  std::string all;
  while (all.size() < at_least) all += bytes;
  return all;
}

class RawListener {
 public:
  RawListener() : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const raw = reinterpret_cast<sockaddr*>(&address);
    if (bind(fd_, raw, size) != 0 || listen(fd_, 8) != 0 || getsockname(fd_, raw, &size) != 0) {
      close(fd_);
      throw std::runtime_error("no loopback port is free");
    }
    endpoint_ = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~RawListener() { close(fd_); }
  RawListener(const RawListener&) = delete;
  RawListener& operator=(const RawListener&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  // The next one who connects, waited for.
  [[nodiscard]] RawPeer accept() const {
    pollfd item{fd_, POLLIN, 0};
    if (poll(&item, 1, static_cast<int>(RawPeer::kPatience.count())) <= 0) {
      throw std::runtime_error("nobody connects to " + endpoint_);
    }
    return RawPeer::of(accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC));
  }

 private:
  int fd_;
  std::string endpoint_;
};

}  // namespace posed::test
