// Connection: an open connection to a device on one descriptor (serial port, pseudo-terminal, TCP
// socket, hidraw node). Cold code uses it first for the start-up sequence; then a LinkTransport
// takes it over for the reader thread.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/address.hpp"
#include "drivers/transport/cancel.hpp"
#include "drivers/transport/first_bytes.hpp"
#include "drivers/transport/paused_hosts.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

class Connection {
 public:
  // Takes ownership of the descriptor, makes it non-blocking and closes it in the end. `name` is
  // for people ("/dev/ttyUSB0"); `identity` is stable ("0403:6001 A9XYZ"). Closing a serial port
  // whose device takes no bytes lasts 30 s, or until the object that heed() names is fired.
  Connection(int fd, std::string name, std::string identity) noexcept;
  ~Connection();
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&& other) noexcept;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::string& identity() const noexcept { return identity_; }

  // Once this is fired, every wait of the cold functions below ends with an error, and closing
  // waits no more.
  void heed(std::shared_ptr<const Cancel> cancel) noexcept { cancel_ = std::move(cancel); }

  // A link over a network. If it floods, make_link_transport ends it and names its host in
  // `paused`. `listener`: somebody else has made it, through this listening socket, which outlives
  // it; -1: posed has. One that somebody else has made ends, as if hung up, if what comes begins as
  // what a web browser sends, and is given up if it is of no use while another one waits.
  void came_through(int listener, const Host& host, std::shared_ptr<PausedHosts> paused) noexcept {
    listener_ = listener;
    host_ = host;
    paused_ = std::move(paused);
    undecided_ = true;
  }
  [[nodiscard]] bool is_of_network() const noexcept { return paused_ != nullptr; }
  // The host of a link over a network must wait before it is heard again. Cold; the thread of the
  // factory.
  void pause_host() noexcept {
    if (paused_) paused_->add(host_);
  }
  [[nodiscard]] bool others_wait() const noexcept { return paused_ && paused_->waiting > 0; }
  [[nodiscard]] bool is_paused() const noexcept { return paused_ && paused_->have(host_); }
  [[nodiscard]] int listener() const noexcept { return listener_; }  // -1: posed made the link
  [[nodiscard]] bool was_browser() const noexcept { return was_browser_; }
  // Reads what is there into the buffer, which has room for more than kMaxBeginning bytes: as
  // ::read(). Bytes that do not yet tell a browser from a device are kept back until they do.
  // RT-safe except for its system calls.
  [[nodiscard]] ssize_t receive(std::span<std::byte> buffer) noexcept;

  // Cold. Writes all bytes, within a second; an error states what happened to the device.
  Result<> write(std::span<const std::byte> bytes);
  Result<> write(std::string_view text);
  // Cold. Returns the bytes that came within `patience`, as soon as there are any; empty when none
  // came.
  Result<std::vector<std::byte>> read(std::chrono::milliseconds patience);
  // Cold. Discards bytes until none has come for `quiet` (at most a second in all).
  Result<> drain(std::chrono::milliseconds quiet);

 private:
  void close() noexcept;
  void wait_for(short events, std::chrono::milliseconds patience) const;
  [[nodiscard]] bool cancelled() const noexcept { return cancel_ && cancel_->fired(); }

  int fd_ = -1, listener_ = -1;
  Host host_{};
  std::shared_ptr<PausedHosts> paused_;
  std::string name_, identity_;
  std::shared_ptr<const Cancel> cancel_;
  bool undecided_ = false, was_browser_ = false;
  FirstLines first_lines_;
  std::array<std::byte, kMaxBeginning> kept_back_{};
  std::size_t kept_ = 0;
};

// Reads the available bytes, at most 4 KB per call; a hang-up or an error of the descriptor sets
// `lost`. For serial ports and sockets, whose writes do not block. The transport is an Upkeep,
// which hangs up on who has sent nothing of use for five seconds while another device waits to
// connect. A flood of what is of no use ends the link, too.
[[nodiscard]] std::unique_ptr<Transport> make_link_transport(Connection link);
// Makes the transport of a link from TransportFactory::hid(), whose writes block: it is also a
// ColdWriter.
[[nodiscard]] std::unique_ptr<Transport> make_hid_transport(Connection link);

}  // namespace posed::drivers
