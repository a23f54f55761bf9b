// RawPeer: a TCP client that sends any bytes, and the frames of ZMTP 3.0 that attacks consist of.
// Every call ends after `kPatience` at the latest. Loopback only.
#pragma once

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace posed::test {

namespace zmtp {

inline std::string greeting(std::string_view mechanism = "NULL") {
  std::string bytes("\xff\0\0\0\0\0\0\0\0\x7f\x03\0", 12);
  bytes.append(mechanism);
  bytes.resize(64, '\0');
  return bytes;
}

// One short or long frame. `flags`: 1 = more parts follow, 4 = command.
inline std::string frame(std::string_view body, int flags = 0) {
  std::string bytes;
  if (body.size() < 256) {
    bytes += static_cast<char>(flags);
    bytes += static_cast<char>(body.size());
  } else {
    bytes += static_cast<char>(flags | 2);
    for (int shift = 56; shift >= 0; shift -= 8) {
      bytes += static_cast<char>(body.size() >> shift & 0xff);
    }
  }
  return bytes.append(body);
}

inline std::string ready(std::string_view socket_type) {
  std::string body("\x05READY\x0bSocket-Type\0\0\0", 21);
  body += static_cast<char>(socket_type.size());
  return frame(body.append(socket_type), 4);
}

inline std::string subscribe(std::string_view topic) {
  return frame(std::string("\1").append(topic));
}

}  // namespace zmtp

class RawPeer {
 public:
  static constexpr std::chrono::milliseconds kPatience{5000};

  // `endpoint` is the one that the daemon reports: tcp://127.0.0.1:PORT.
  explicit RawPeer(const std::string& endpoint)
      : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int port = std::atoi(endpoint.substr(endpoint.rfind(':') + 1).c_str());
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      close(fd_);
      throw std::runtime_error("nothing listens at " + endpoint);
    }
  }
  // The other side of a connection that was accepted.
  [[nodiscard]] static RawPeer of(int fd) { return RawPeer(fd); }
  ~RawPeer() {
    if (fd_ >= 0) close(fd_);
  }
  RawPeer(RawPeer&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  RawPeer& operator=(RawPeer&&) = delete;

  // Returns true when all bytes were sent; false when the other side hung up or accepts no more in
  // time.
  bool send(std::string_view bytes, std::chrono::milliseconds within = kPatience) const {
    const auto end = std::chrono::steady_clock::now() + within;
    while (!bytes.empty()) {
      const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
      if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
      if (bytes.empty()) break;
      if (std::chrono::steady_clock::now() > end) return false;
      if (sent < 0 && !wait(POLLOUT, std::chrono::milliseconds(10))) continue;
    }
    return true;
  }
  // Receives until `size` bytes have arrived, the other side hangs up, or time is up.
  std::string receive(std::size_t size, std::chrono::milliseconds within = kPatience) const {
    const auto end = std::chrono::steady_clock::now() + within;
    std::string all;
    while (all.size() < size && std::chrono::steady_clock::now() < end) {
      if (!wait(POLLIN, std::chrono::milliseconds(10))) continue;
      char buffer[4096];
      const ssize_t got =
          recv(fd_, buffer, std::min(sizeof buffer, size - all.size()), MSG_DONTWAIT);
      if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) break;
      if (got > 0) all.append(buffer, static_cast<std::size_t>(got));
    }
    return all;
  }
  // Whether the other side hangs up in time; bytes that it sends before are discarded.
  bool hung_up(std::chrono::milliseconds within = kPatience) const {
    const auto end = std::chrono::steady_clock::now() + within;
    while (std::chrono::steady_clock::now() < end) {
      if (!wait(POLLIN, std::chrono::milliseconds(10))) continue;
      char buffer[65536];
      const ssize_t got = recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT);
      if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return true;
    }
    return false;
  }
  // Performs the ZMTP handshake as a socket of this type; false when refused.
  bool shake_hands(std::string_view socket_type) const {
    if (!send(zmtp::greeting()) || receive(64).size() < 64) return false;
    return send(zmtp::ready(socket_type)) && !receive(20).empty();
  }

 private:
  explicit RawPeer(int fd) : fd_(fd) {}
  bool wait(short events, std::chrono::milliseconds within) const {
    pollfd item{fd_, events, 0};
    return poll(&item, 1, static_cast<int>(within.count())) > 0;
  }

  int fd_;
};

}  // namespace posed::test
