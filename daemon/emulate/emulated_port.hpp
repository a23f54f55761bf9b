// EmulatedPort connects an emulator with a program that expects a glove: through a pseudo-terminal
// for serial gloves, or through a TCP connection to the host for gloves that connect to it. Cold.
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
  // A pseudo-terminal in raw mode. With `link`, a symbolic link at that path points to it while it
  // is open. An existing link is replaced; any other file is an error.
  [[nodiscard]] static Result<EmulatedPort> open_pty(const std::filesystem::path& link = {});
  // Connects to HOST:PORT, numbers only; fails if nothing listens there.
  [[nodiscard]] static Result<EmulatedPort> connect_tcp(const std::string& endpoint);

  ~EmulatedPort();
  EmulatedPort(EmulatedPort&& other) noexcept;
  EmulatedPort& operator=(EmulatedPort&&) = delete;
  EmulatedPort(const EmulatedPort&) = delete;
  EmulatedPort& operator=(const EmulatedPort&) = delete;

  // What the host opens: "/dev/pts/3", "127.0.0.1:5200".
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  // What the host sent. Waits for at most `patience`; empty if nothing came, nullopt if the host
  // has closed the connection for good.
  [[nodiscard]] std::optional<std::vector<std::byte>> receive(std::chrono::nanoseconds patience);
  // Sends what fits: a host that does not read loses bytes, as with a real device.
  void send(std::span<const std::byte> bytes) noexcept;

 private:
  EmulatedPort(int fd, int other_side, std::string name, std::filesystem::path link)
      : fd_(fd), other_side_(other_side), name_(std::move(name)), link_(std::move(link)) {}

  int fd_;
  // the host's end of a pseudo-terminal, kept open so that the terminal survives a host that closes
  // its own
  int other_side_;
  std::string name_;
  std::filesystem::path link_;
};

}  // namespace posed::emulate
