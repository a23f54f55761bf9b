// ReplayTransport: plays the recorded chunks of a device at their recorded times.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/chunks.hpp"

namespace posed::drivers {

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
  Chunks chunks_;
  std::vector<std::int64_t> arrival_ns_;  // [chunk]
  std::vector<std::uint8_t> socket_;      // [chunk], as Chunk::socket
};

// A chunk is due (arrival - origin) / speed after start(), and at once if that is negative. Streams
// of one log share an origin, the log's first arrival, so the time between them is kept.
class ReplayTransport final : public Transport {
 public:
  // `speed` 1 is the recorded pace, 0 as fast as possible. An empty recording ends with its first
  // read(). A chunk longer than kMaxChunk or an invalid speed is an error.
  static Result<std::unique_ptr<Transport>> open(Recording recording, std::int64_t origin_ns,
                                                 double speed);

  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  [[nodiscard]] bool lossless() const noexcept override { return speed_ == 0.0; }
  Result<> start(std::int64_t now_ns) override;
  // After the last chunk it returns an empty one that says `end`; that is due at once. RT-safe: no
  // system call at all.
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  ReplayTransport(Recording recording, std::int64_t origin_ns, double speed)
      : recording_(std::move(recording)), origin_ns_(origin_ns), speed_(speed) {}

  Recording recording_;
  std::int64_t origin_ns_;
  double speed_;
  std::int64_t start_ns_ = 0;
  std::size_t next_ = 0;
};

}  // namespace posed::drivers
