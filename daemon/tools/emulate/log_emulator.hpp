// LogEmulator: a recorded device that can be opened again. The driver's emulator answers the host
// as the device did; once the host has started the stream, the log's bytes are sent, at the
// recorded times.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/emulator.hpp"
#include "drivers/transport/chunks.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

// The chunks of one stream in the order of the log; arrival times may step back.
class Recording {
 public:
  void add(std::int64_t arrival_ns, std::span<const std::byte> bytes, std::uint8_t socket = 0) {
    chunks_.add(bytes);
    arrival_ns_.push_back(arrival_ns);
    socket_.push_back(socket);
  }
  [[nodiscard]] std::size_t count() const noexcept { return chunks_.count(); }
  // Valid until the next add().
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t i) const noexcept {
    return chunks_[i];
  }
  [[nodiscard]] std::int64_t arrival_ns(std::size_t i) const noexcept { return arrival_ns_[i]; }
  [[nodiscard]] std::uint8_t socket(std::size_t i) const noexcept { return socket_[i]; }

 private:
  drivers::Chunks chunks_;
  std::vector<std::int64_t> arrival_ns_;  // [chunk]
  std::vector<std::uint8_t> socket_;      // [chunk], as Chunk::socket
};

class LogEmulator final : public drivers::Emulator {
 public:
  // `speaker` may be null: a device that streams by itself and ignores what the host sends.
  LogEmulator(Recording recording, std::unique_ptr<drivers::Emulator> speaker);

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

  Recording recording_;
  std::unique_ptr<drivers::Emulator> speaker_;
  std::size_t next_ = 0;
  std::int64_t start_ns_ = 0;  // device time of the first chunk
};

// The chunks that a stream of the log received. Without a name the log must have only one stream.
// `addresses`: how many sockets of a host they are to be sent to; as many as the device knew.
struct LoggedDevice {
  std::string stream, driver, text;
  Recording recording;
};
Result<LoggedDevice> read_logged_device(const std::string& log, const std::string& stream,
                                        std::size_t addresses);

}  // namespace posed::emulate
