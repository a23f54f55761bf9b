// GenerateStage: the live smoother on any skeleton, and on hands the playback behind it. Frames of
// a stream that only performs (Source::kLabels) are not smoothed and have no lag. A performed frame
// is, to a client, a frame like any other: measured quality, its stream's own sequence and times;
// `source` says labels, and label and probability say what.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "models/generate/bound_model.hpp"
#include "models/generate/gesture_player.hpp"
#include "models/smooth/live_options.hpp"
#include "models/smooth/live_smoother.hpp"
#include "models/stage.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::generate {

class GenerateStage final : public Stage {
 public:
  // `model` outlives its use here; may be null, and must be for a skeleton that is no hand's.
  GenerateStage(std::shared_ptr<const Skeleton> skeleton, const smooth::LiveOptions& options,
                double rate_hz, const BoundModel* model);

  // Emits the frames that are due. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;
  // Frames that wait go out after a few frames' silence, and a performance goes on at the stream's
  // rate, under the last frame's sequence. RT-safe.
  void heard(std::int64_t arrival_ns) noexcept override;
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  void tick(std::int64_t now_ns, StageOut& out) noexcept override;
  // Emits the frames that wait: the source has ended. RT-safe.
  void flush(StageOut& out) noexcept override;
  [[nodiscard]] bool performs() const noexcept override { return player_.busy(); }

  // All RT-safe; in effect from the next frame that is emitted.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept { return player_.play(order); }
  void stop_playing() noexcept { player_.stop(); }
  void set_model(const BoundModel* model) noexcept;

  [[nodiscard]] const BoundModel* model() const noexcept { return model_; }

 private:
  // Where the smoother puts its frames.
  class Smoothed;

  void smoothed(const StageFrame& frame, StageOut& out) noexcept;
  void show(Frame& frame, const HandAngles* live, StageOut& out) noexcept;
  // Of the frame that goes out.
  [[nodiscard]] std::span<const double> variance_rad2() const noexcept {
    return std::span(variance_rad2_).first(channels_);
  }

  std::shared_ptr<const Skeleton> skeleton_;
  bool hand_;
  smooth::LiveSmoother smoother_;
  GesturePlayer player_;
  const BoundModel* model_;
  std::int64_t period_ns_;  // of a performance that goes on in silence
  std::int64_t last_heard_ns_ = kNoTime_ns;
  std::int64_t last_tick_ns_ = kNoTime_ns;  // in this silence
  int entered_ = 0;                         // frames that wait in the smoother
  bool has_last_ = false;
  bool live_seen_ = false;  // a hand came; else the stream only performs
  Frame last_;              // that went out
  HandAngles live_{};
  std::size_t channels_ = 0;  // of the frame emitted last
  std::array<double, kMaxChannels> variance_rad2_{};
};

}  // namespace posed::generate
