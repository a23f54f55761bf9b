// LogEmulator: a recorded device that can be opened again. The driver's emulator answers the host
// as the device did; once the host has started the stream, the log's bytes are sent, at the
// recorded times.
#pragma once

#include <memory>

#include "drivers/emulator.hpp"
#include "drivers/transport/replay.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

class LogEmulator final : public drivers::Emulator {
 public:
  // `speaker` may be null: a device that streams by itself and ignores what the host sends.
  LogEmulator(drivers::Recording recording, std::unique_ptr<drivers::Emulator> speaker);

  void pose(std::size_t /*body*/, const Frame& /*frame*/) override {}
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override {
    receive_socket(0, bytes, now_ns, answer);
  }
  void receive_socket(std::uint8_t socket, std::span<const std::byte> bytes, std::int64_t now_ns,
                      Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override;
  // That which the datagram came to when it was recorded.
  [[nodiscard]] std::uint8_t next_socket() const override {
    return done() ? std::uint8_t{0} : recording_.socket(next_);
  }
  [[nodiscard]] std::vector<std::uint16_t> ports() const override {
    return speaker_ == nullptr ? Emulator::ports() : speaker_->ports();
  }
  void emit(std::int64_t now_ns, Bytes& out) override;

  [[nodiscard]] bool done() const noexcept { return next_ == recording_.count(); }

 private:
  [[nodiscard]] bool streams() const {
    return speaker_ == nullptr || speaker_->next_due_ns() != kNoTime_ns;
  }

  drivers::Recording recording_;
  std::unique_ptr<drivers::Emulator> speaker_;
  std::size_t next_ = 0;
  std::int64_t start_ns_ = 0;  // device time of the first chunk
};

// The chunks that a stream of the log received. Without a name the log must have only one stream.
// `addresses`: how many sockets of a host they are to be sent to; as many as the device knew.
struct LoggedDevice {
  std::string stream, driver, text;
  drivers::Recording recording;
};
Result<LoggedDevice> read_logged_device(const std::string& log, const std::string& stream,
                                        std::size_t addresses);

}  // namespace posed::emulate
