// MergeStage: the hands of gloves on the body of another stream (README.md). It holds each frame of
// the body until every glove that is there has measured up to its time, at most `wait_ns`, and
// gives it the hand poses of that time. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "models/merge/hand_track.hpp"
#include "models/merge/merge_plan.hpp"
#include "models/stage.hpp"

namespace posed::merge {

class MergeStage final : public Stage {
 public:
  // Frames of the body that wait at once; one more releases the oldest as it is.
  static constexpr std::size_t kWaiting = 8;

  explicit MergeStage(MergePlan plan);

  void process(const StageFrame& in, StageOut& out) noexcept override;
  // Number 0 is the left glove, 1 the right one.
  void partner(std::size_t partner, const StageFrame& in, StageOut& out) noexcept override;
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  void tick(std::int64_t now_ns, StageOut& out) noexcept override;
  void flush(StageOut& out) noexcept override;

 private:
  [[nodiscard]] bool ready(const Frame& frame, std::int64_t now_ns) const noexcept;
  void release_ready(std::int64_t now_ns, StageOut& out) noexcept;
  void release(std::int64_t now_ns, StageOut& out) noexcept;

  MergePlan plan_;
  std::array<std::optional<HandTrack>, 2> tracks_{};
  std::array<Frame, kWaiting> waiting_{};  // a ring; the oldest is at `first_`
  std::size_t first_ = 0, count_ = 0;
  Frame merged_;  // the last one: the next one's angles stay near to it
};

// When the frame was measured, on the host's clock: by the device's clock, if it has one. RT-safe.
[[nodiscard]] std::int64_t time_of(const Header& header) noexcept;

}  // namespace posed::merge
