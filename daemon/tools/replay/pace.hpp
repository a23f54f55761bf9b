// Pace: when the chunks of a log are due in a replay at the recorded speed. A silence of more than
// a minute is skipped, whether the recording paused or a time in the log is wrong.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "daemon/pipeline/record_sink.hpp"
#include "proto/frame/time.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

class Pace {
 public:
  static constexpr std::int64_t kMaxSilence_ns = 60 * kNanosPerSecond;

  // `speed` is above zero; 2 replays in half the recorded time.
  explicit Pace(double speed) : speed_(speed) {}

  struct Step {
    std::int64_t due_ns = 0;      // after the first chunk
    std::int64_t skipped_ns = 0;  // the silence before the chunk that was skipped; 0: none
  };
  Step step(const log::ChunkRow& chunk) {
    // A calibration's arrival time is only that of the chunk before it, or unset.
    if (static_cast<pipeline::Direction>(chunk.direction) == pipeline::Direction::kCalibration)
      return {due_ns_, 0};
    const std::int64_t since_ns = chunk.arrival_ns - last_ns_.value_or(chunk.arrival_ns);
    const bool too_long = since_ns > kMaxSilence_ns;
    const bool back = since_ns < -kMaxSilence_ns;  // the recording has returned from a wrong time
    if (!last_ns_ || too_long || back) {
      last_ns_ = chunk.arrival_ns;
      return {due_ns_, too_long ? since_ns : 0};
    }
    last_ns_ = std::max(*last_ns_, chunk.arrival_ns);
    due_ns_ += nanoseconds(seconds(std::max<std::int64_t>(since_ns, 0)) / speed_);
    return {due_ns_, 0};
  }

 private:
  double speed_;
  std::int64_t due_ns_ = 0;
  std::optional<std::int64_t> last_ns_;  // the latest arrival; empty before the first chunk
};

}  // namespace posed::replay
