// A template mocap system with many people, sent to one port of this machine: people enter, leave
// and return with other skeletons.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "drivers/template_mocap/protocol.hpp"

namespace posed::test {

// The first two people stay.
class MocapRoom {
 public:
  explicit MocapRoom(std::uint16_t port) : port_(port), fd_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    for (std::size_t i = 0; i < kPeople; ++i) joints_[i] = 3;
  }
  ~MocapRoom() { ::close(fd_); }
  MocapRoom(const MocapRoom&) = delete;
  MocapRoom& operator=(const MocapRoom&) = delete;

  // Some people enter, leave, or return with another skeleton.
  void change() {
    for (std::size_t i = 2; i < kPeople; ++i) {
      const auto die = random_() % 3;
      if (die == 0) present_ ^= 1U << i;
      if (die == 1) joints_[i] = 2 + static_cast<unsigned>(random_() % 5);
    }
    describe();
  }

  void describe() {
    std::vector<drivers::mocap::BodyEntry> bodies;
    for (std::size_t i = 0; i < kPeople; ++i) {
      if ((present_ >> i & 1U) == 0) continue;
      drivers::mocap::BodyEntry body{
          .id = static_cast<std::uint16_t>(i), .name = "Person " + std::to_string(i), .joints = {}};
      for (unsigned j = 0; j < joints_[i]; ++j) {
        body.joints.push_back({.name = "joint" + std::to_string(j),
                               .parent = static_cast<int>(j) - 1,
                               .offset_m = {0.0F, 0.2F, 0.0F}});
      }
      bodies.push_back(std::move(body));
    }
    send(drivers::mocap::encode_description(bodies));
  }

  void frame() {
    drivers::mocap::FramePacket packet{
        .number = number_, .time_us = number_ * 10'000, .bodies = {}};
    ++number_;
    const float half = 0.3F * std::sin(0.05F * static_cast<float>(number_));
    for (std::size_t i = 0; i < kPeople; ++i) {
      if ((present_ >> i & 1U) == 0) continue;
      packet.bodies.push_back({.id = static_cast<std::uint16_t>(i),
                               .root_m = {0.0F, 1.0F, 0.01F * static_cast<float>(number_)},
                               .rotation_xyzw = std::vector<Quatf>(
                                   joints_[i], Quatf{std::sin(half), 0.0F, 0.0F, std::cos(half)})});
    }
    send(drivers::mocap::encode_frame(packet));
  }

 private:
  static constexpr std::size_t kPeople = 12;

  void send(const std::vector<std::byte>& datagram) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(port_);
    static_cast<void>(::sendto(fd_, datagram.data(), datagram.size(), 0,
                               reinterpret_cast<const sockaddr*>(&to), sizeof to));
  }

  std::uint16_t port_;
  int fd_;
  std::mt19937 random_{7};
  unsigned present_ = 3;
  std::array<unsigned, kPeople> joints_{};
  std::uint32_t number_ = 1;
};

}  // namespace posed::test
