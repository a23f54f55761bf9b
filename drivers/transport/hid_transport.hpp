// HidTransport: reads one report per read from a hidraw node. Each report to the device is one
// write, which the device's supervisor does (cold_writer.hpp explains why).
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <boost/lockfree/spsc_queue.hpp>

#include "drivers/driver.hpp"
#include "drivers/transport/cold_writer.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/event_fd.hpp"

namespace posed::drivers {

class HidTransport final : public Transport, public ColdWriter {
 public:
  explicit HidTransport(Connection link);

  [[nodiscard]] int poll_fd() const noexcept override { return reader_->poll_fd(); }
  Result<> start(std::int64_t now_ns) override { return reader_->start(now_ns); }
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override { return reader_->read(now_ns); }
  // Queues the report and wakes the supervisor with one write to an eventfd. RT-safe except for
  // that.
  [[nodiscard]] bool send(std::span<const std::byte> bytes, std::uint8_t socket) noexcept override;

  [[nodiscard]] int waiting_fd() const noexcept override { return waiting_.fd(); }
  void write_waiting() noexcept override;
  [[nodiscard]] std::uint64_t dropped() const noexcept override { return dropped_.load(); }

 private:
  static constexpr std::size_t kMaxReport = 1024;  // bytes; full-speed USB has 64
  static constexpr std::size_t kQueue = 16;        // reports
  static constexpr std::size_t kBacklog = 4;       // number of reports that are still worth sending
  struct Report {
    std::size_t size = 0;
    std::array<std::byte, kMaxReport> bytes;
  };

  int fd_;
  RawEventFd waiting_;
  std::unique_ptr<Transport> reader_;
  boost::lockfree::spsc_queue<Report, boost::lockfree::capacity<kQueue>> queue_;
  Report sending_;  // belongs to the reader thread; a member because it is large
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace posed::drivers
