// Emulated devices: EmulatedDevice runs an emulator with a motion, behind an EmulatedPort that a
// driver opens as it would open the device. Cold.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/emulate/faults.hpp"
#include "drivers/emulator.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::emulate {

// EmulatedPort connects an emulator with a program that expects a device: through a pseudo-terminal
// for serial gloves, through a TCP connection to the host or from it, through UDP, or through
// ZeroMQ.
class EmulatedPort {
 public:
  // A pseudo-terminal in raw mode. With `link`, a symbolic link at that path points to it while it
  // is open. An existing link is replaced; any other file is an error.
  static Result<EmulatedPort> open_pty(const std::filesystem::path& link = {});
  // Connects to HOST:PORT, numbers only; fails if nothing listens there.
  static Result<EmulatedPort> connect_tcp(const std::string& endpoint);

  // Waits at IP:PORT for the host to connect, for systems that serve their data. The newest
  // connection counts; port 0 means any that is free, and name() says which.
  static Result<EmulatedPort> listen_tcp(const std::string& endpoint);

  // Sends datagrams to these sockets of the host, "IP:PORT", whether or not it is there already.
  // `ports`: those of this machine that they come from; 0 or left out: any.
  static Result<EmulatedPort> open_udp(const std::vector<std::string>& endpoints,
                                       const std::vector<std::uint16_t>& ports = {});

  // Publishes over ZeroMQ at this endpoint, "tcp://127.0.0.1:5575": what send() gets is a topic, a
  // zero byte and the message.
  static Result<EmulatedPort> publish(const std::string& endpoint);

  ~EmulatedPort();
  EmulatedPort(EmulatedPort&& other) noexcept;
  EmulatedPort& operator=(EmulatedPort&&) = delete;
  EmulatedPort(const EmulatedPort&) = delete;
  EmulatedPort& operator=(const EmulatedPort&) = delete;

  // What the host opens: "/dev/pts/3", "127.0.0.1:5200".
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  struct Received {
    std::uint8_t socket = 0;  // of the host
    std::vector<std::byte> bytes{};
  };
  // What the host sent. Waits for at most `patience`; empty if nothing came, nullopt if the host
  // has closed the connection for good.
  [[nodiscard]] std::optional<Received> receive(std::chrono::nanoseconds patience);
  // Sends what fits: a host that does not read loses bytes, as with a real device.
  void send(std::uint8_t socket, std::span<const std::byte> bytes) noexcept;

 private:
  enum class Kind : std::uint8_t { kTerminal, kTcp, kTcpServer, kUdp, kPublish };
  EmulatedPort(Kind kind, std::vector<int> fds, std::string name) noexcept
      : kind_(kind), fds_(std::move(fds)), name_(std::move(name)) {}

  // Replaces the connection by one that waits, if any.
  void accept() noexcept;

  Kind kind_;
  std::vector<int> fds_;  // [socket of the host]
  // the host's end of a pseudo-terminal, kept open so that the terminal survives a host that closes
  // its own
  int other_side_ = -1;
  int listener_ = -1;  // of a server
  std::string name_;
  std::filesystem::path link_;
  net::Context context_;  // of a publisher
  net::Socket publisher_;
};

// The pose of a recorded hand, interpolated between frames and repeated in a loop; missing values
// are zero.
[[nodiscard]] HandAngles pose_at(const clip::HandClip& clip, double time_s);

// Poses the emulator's bodies for a time since the start; empty: they move by themselves, or not.
using Motion = std::function<void(double time_s, drivers::Emulator& emulator)>;

// The motion of a glove whose hand has these angles.
[[nodiscard]] Motion hand_motion(std::function<HandAngles(double time_s)> angles_at);

// EmulatedDevice runs an emulator: it connects a motion, a port and the host's clock. `posed
// emulate` runs one until it ends, the demo runs one on a thread.
class EmulatedDevice {
 public:
  using Bytes = drivers::Emulator::Bytes;
  struct Settings {
    double speed = 1.0;  // relative to the device's own rate
    // of the line, applied one after the other
    std::vector<drivers::emulate::FaultInjector> faults{};
  };

  EmulatedDevice(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port, Motion motion,
                 Settings settings);

  [[nodiscard]] const std::string& port() const noexcept { return port_.name(); }

  // Runs until a stop is requested or the host has closed the connection for good. Blocks.
  void run(const std::stop_token& stop);

  [[nodiscard]] std::uint64_t packets() const noexcept { return packets_.load(); }

 private:
  void emit(std::int64_t device_ns);

  std::unique_ptr<drivers::Emulator> emulator_;
  EmulatedPort port_;
  Motion motion_;
  Settings settings_;
  Bytes packet_, passed_;
  std::atomic<std::uint64_t> packets_{0};
};

}  // namespace posed::emulate
