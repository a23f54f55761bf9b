// A bad network between two sockets of this machine: datagrams are lost, delayed, exchanged and
// doubled, in a random order that the seed decides. For the tests.
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <map>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <catch2/catch.hpp>

#include "drivers/transport/address.hpp"

namespace posed::test {

class UdpProxy {
 public:
  struct Faults {
    double loss = 0.0;                    // part of the datagrams
    double duplicate = 0.0;               // part of the datagrams, which arrive twice
    std::chrono::microseconds jitter{0};  // a datagram is late by 0 to this, uniformly
  };

  // From a port of its own to `to`, "127.0.0.1:PORT".
  UdpProxy(const std::string& to, const Faults& faults, unsigned seed)
      : to_(drivers::parse_endpoint(to).value()), faults_(faults), random_(seed) {
    fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto own = drivers::parse_endpoint("127.0.0.1:0").value();
    REQUIRE(::bind(fd_, own.get(), own.size) == 0);
    drivers::Address bound;
    ::getsockname(fd_, bound.get(), &bound.size);
    endpoint_ = drivers::endpoint_text(bound);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~UdpProxy() {
    thread_ = {};
    ::close(fd_);
  }
  UdpProxy(const UdpProxy&) = delete;
  UdpProxy& operator=(const UdpProxy&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  // While it is cut, everything is lost.
  void cut(bool on) { cut_ = on; }

 private:
  using Time = std::chrono::steady_clock::time_point;

  [[nodiscard]] bool happens(double probability) {
    return std::uniform_real_distribution<>(0.0, 1.0)(random_) < probability;
  }
  [[nodiscard]] Time due() {
    const auto most = std::max<std::int64_t>(faults_.jitter.count(), 0);
    const std::chrono::microseconds late(
        std::uniform_int_distribution<>(0, static_cast<int>(most))(random_));
    return std::chrono::steady_clock::now() + late;
  }

  void run(const std::stop_token& stop) {
    std::multimap<Time, std::vector<std::byte>> waiting;
    while (!stop.stop_requested()) {
      pollfd ready{.fd = fd_, .events = POLLIN, .revents = 0};
      if (::poll(&ready, 1, 1) > 0) {
        std::vector<std::byte> datagram(65'507);
        const ssize_t got = ::recv(fd_, datagram.data(), datagram.size(), 0);
        if (got < 0) continue;
        datagram.resize(static_cast<std::size_t>(got));
        const bool lost = happens(faults_.loss);
        const bool twice = happens(faults_.duplicate);
        if (!lost && !cut_) {
          if (twice) waiting.emplace(due(), datagram);
          waiting.emplace(due(), std::move(datagram));
        }
      }
      while (!waiting.empty() && waiting.begin()->first <= std::chrono::steady_clock::now()) {
        const auto& bytes = waiting.begin()->second;
        static_cast<void>(::sendto(fd_, bytes.data(), bytes.size(), 0, to_.get(), to_.size));
        waiting.erase(waiting.begin());
      }
    }
  }

  drivers::Address to_;
  Faults faults_;
  std::mt19937 random_;
  int fd_ = -1;
  std::string endpoint_;
  std::atomic<bool> cut_{false};
  std::jthread thread_;
};

}  // namespace posed::test
