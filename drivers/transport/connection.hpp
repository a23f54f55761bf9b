// Connection: an open connection to a device on one descriptor (serial port, pseudo-terminal, TCP
// socket, hidraw node). First cold code speaks through it (the start-up sequence), then a
// LinkTransport takes it over for the reader thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/cancel.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

class Connection {
 public:
  // Takes the descriptor over: non-blocking, closed in the end. `name` is for people
  // ("/dev/ttyUSB0"), `identity` is stable ("0403:6001 A9XYZ").
  Connection(int fd, std::string name, std::string identity) noexcept;
  ~Connection();
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&& other) noexcept;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::string& identity() const noexcept { return identity_; }

  // Every wait of the cold functions below ends with an error once this is fired.
  void heed(std::shared_ptr<const Cancel> cancel) noexcept { cancel_ = std::move(cancel); }

  // Cold. All bytes, within a second; an error says what happened to the device.
  [[nodiscard]] Result<> write(std::span<const std::byte> bytes);
  [[nodiscard]] Result<> write(std::string_view text);
  // Cold. What came within `patience`, at once when there is something; empty when nothing came.
  [[nodiscard]] Result<std::vector<std::byte>> read(std::chrono::milliseconds patience);
  // Cold. Throws away what comes until nothing has come for `quiet` (at most a second in all).
  [[nodiscard]] Result<> drain(std::chrono::milliseconds quiet);

 private:
  void wait_for(short events, std::chrono::milliseconds patience) const;
  [[nodiscard]] bool cancelled() const noexcept { return cancel_ && cancel_->fired(); }

  int fd_ = -1;
  std::string name_, identity_;
  std::shared_ptr<const Cancel> cancel_;
};

// Reads what the link has, at most 4 KB a call; a hang-up or an error of the descriptor is `lost`.
// For serial ports and sockets, whose writes do not block.
[[nodiscard]] std::unique_ptr<Transport> make_link_transport(Connection link);
// The same for a link of TransportFactory::hid(), whose writes block: it is a ColdWriter, too.
[[nodiscard]] std::unique_ptr<Transport> make_hid_transport(Connection link);

}  // namespace posed::drivers
