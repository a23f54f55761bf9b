// FileTransport: plays recorded chunks at a steady rate, looped or once.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/chunks.hpp"

namespace posed::drivers {

struct PlaybackOptions {
  double rate_hz = 0.0;  // of the recording, in chunks
  double pace = 1.0;     // of its clock; 0 is as fast as it can be used
  bool loop = true;
  // When each chunk is due on the recording's clock [s], increasing; empty: evenly at rate_hz.
  std::vector<double> time_s{};
};

// Chunk n is due n / (rate * pace) after start(), or at its own time / pace, on an absolute
// schedule (a round after the last chunk's time comes one step later): what was late once does not
// stay late, nothing drifts, and after a stop of the process all that fell due comes at once.
class FileTransport final : public Transport {
 public:
  // At least one chunk, none longer than kMaxChunk. An impossible pace or rate is misuse.
  [[nodiscard]] static Result<std::unique_ptr<Transport>> open(Chunks chunks,
                                                               const PlaybackOptions& playback);

  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  [[nodiscard]] bool lossless() const noexcept override { return period_ns_ == 0.0; }
  [[nodiscard]] double rate_hz() const noexcept override {
    return lossless() ? 0.0 : 1e9 / period_ns_;
  }
  // Whether it begins again after the last chunk, so that it never ends.
  [[nodiscard]] bool loops() const noexcept { return loop_; }
  [[nodiscard]] Result<> start(std::int64_t now_ns) override;
  // Ends with an empty chunk after the last. RT-safe: no system call at all.
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  FileTransport(Chunks chunks, double period_ns, const PlaybackOptions& playback);

  Chunks chunks_;
  double period_ns_;  // 0: always due
  bool loop_;
  std::vector<double> due_ns_;  // [chunk] after the round's begin; empty: evenly
  double round_ns_ = 0.0;       // how long a round lasts
  std::int64_t start_ns_ = 0;
  std::uint64_t given_ = 0;  // chunks, over all loops
};

}  // namespace posed::drivers
