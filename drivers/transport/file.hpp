// FileTransport: plays recorded chunks at a steady rate, looped or once.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/chunks.hpp"

namespace posed::drivers {

struct PlaybackOptions {
  double rate_hz = 0.0;  // chunks per second of the recording
  double pace = 1.0;     // factor on the speed of the recording; 0 is as fast as possible
  bool loop = true;
  std::size_t again_from = 0;  // the chunk with which each loop but the first begins
  // Due time of each chunk on the recording's clock [s], increasing; empty: evenly at rate_hz.
  std::vector<double> time_s{};
};

// Chunk n is due n / (rate * pace) after start(), or at its own time / pace, on an absolute
// schedule (a new loop begins one step after the last chunk's time). So one late chunk does not
// delay the next, nothing drifts, and after the process was stopped all due chunks come at once.
class FileTransport final : public Transport {
 public:
  // Needs more than again_from chunks, and none longer than kMaxChunk. An invalid pace or rate is
  // misuse.
  static Result<std::unique_ptr<Transport>> open(Chunks chunks, const PlaybackOptions& options);

  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  [[nodiscard]] bool lossless() const noexcept override { return period_ns_ == 0.0; }
  [[nodiscard]] double rate_hz() const noexcept override {
    return lossless() ? 0.0 : 1e9 / period_ns_;
  }
  // True when it starts again after the last chunk, so that it never ends.
  [[nodiscard]] bool loops() const noexcept { return loop_; }
  Result<> start(std::int64_t now_ns) override;
  // Ends with an empty chunk after the last. RT-safe: no system call at all.
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  FileTransport(Chunks chunks, double period_ns, const PlaybackOptions& options);

  [[nodiscard]] std::size_t index() const noexcept;  // of the next chunk

  Chunks chunks_;
  double period_ns_;  // 0: always due
  bool loop_;
  std::size_t again_from_;
  std::vector<double> due_ns_;  // [chunk] from the start of the loop; empty: evenly
  double round_ns_ = 0.0;       // duration of a loop but the first
  std::int64_t start_ns_ = 0;
  std::uint64_t given_ = 0;  // chunks given so far, over all loops
};

}  // namespace posed::drivers
