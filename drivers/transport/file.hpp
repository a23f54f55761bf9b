// FileTransport: plays recorded chunks at a steady rate, looped or once.
#pragma once

#include <cstdint>
#include <memory>

#include "drivers/driver.hpp"
#include "drivers/transport/chunks.hpp"
#include "drivers/transport/timer.hpp"

namespace posed::drivers {

struct Playback {
  double rate_hz = 0.0;  // of the recording, in chunks
  double pace = 1.0;     // of its clock; 0 gives a chunk whenever asked, as fast as possible
  bool loop = true;
};

// Chunk n is due n periods after start(), on an absolute schedule: what was late once does not stay
// late, and after a stop of the process all that fell due comes at once. The period is
// 1 / (rate * pace), rounded to a nanosecond.
class FileTransport final : public Transport {
 public:
  // At least one chunk, none longer than kMaxChunk. An impossible pace or rate is misuse.
  [[nodiscard]] static Result<std::unique_ptr<Transport>> open(Chunks chunks,
                                                               const Playback& playback);

  [[nodiscard]] int poll_fd() const noexcept override { return timer_.fd(); }
  [[nodiscard]] Result<> start(std::int64_t now_ns) override;
  // Ends with an empty chunk after the last. One read of the timer where the source is paced.
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  FileTransport(Chunks chunks, std::int64_t period_ns, bool loop)
      : chunks_(std::move(chunks)), period_ns_(period_ns), loop_(loop) {}
  [[nodiscard]] bool take_due() noexcept;

  Timer timer_;
  Chunks chunks_;
  std::int64_t period_ns_;  // 0: as fast as possible
  bool loop_;
  std::size_t next_ = 0;
  std::uint64_t due_ = 0;  // chunks whose time has come
  bool gave_ = false;      // unpaced: the last read gave a chunk
};

}  // namespace posed::drivers
