// EmulatedPort: what stands between an emulator and a program that expects a glove: a
// pseudo-terminal for serial gloves, or a TCP connection to the host for gloves that connect to it.
// Cold.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::emulate {

class EmulatedPort {
 public:
  // A pseudo-terminal in raw mode. With `link` that path leads to it as long as it is open (a link
  // that is there already is replaced; anything else is not).
  [[nodiscard]] static Result<EmulatedPort> open_pty(const std::filesystem::path& link = {});
  // Connects to HOST:PORT, numbers only; fails when nobody listens.
  [[nodiscard]] static Result<EmulatedPort> connect_tcp(const std::string& endpoint);

  ~EmulatedPort();
  EmulatedPort(EmulatedPort&& other) noexcept;
  EmulatedPort& operator=(EmulatedPort&&) = delete;
  EmulatedPort(const EmulatedPort&) = delete;
  EmulatedPort& operator=(const EmulatedPort&) = delete;

  // What the other side opens: "/dev/pts/3", "127.0.0.1:5200".
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  // What the host sent, waiting until `patience` has passed; empty when nothing came, nothing at
  // all (nullopt) when the host has hung up for good.
  [[nodiscard]] std::optional<std::vector<std::byte>> receive(std::chrono::nanoseconds patience);
  // Sends what fits: a host that does not read loses bytes, as with a real device.
  void send(std::span<const std::byte> bytes) noexcept;

 private:
  EmulatedPort(int fd, int other_side, std::string name, std::filesystem::path link)
      : fd_(fd), other_side_(other_side), name_(std::move(name)), link_(std::move(link)) {}

  int fd_;
  int other_side_;  // of a pseudo-terminal, kept open so that its master survives a host that goes
  std::string name_;
  std::filesystem::path link_;
};

}  // namespace posed::emulate
