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
#include "proto/frame/sink.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::generate {

class GenerateStage final : public Stage, private Emit {
 public:
  // `model` outlives its use here; may be null, and must be for a skeleton that is no hand's.
  GenerateStage(std::shared_ptr<const Skeleton> skeleton, const smooth::LiveOptions& options,
                double rate_hz, const BoundModel* model);

  // Emits the frames that are due. A tick (null) says that nothing came: the frames that still wait
  // go out, and a performance goes on by one frame, under the last frame's sequence. RT-safe.
  void step(const Frame* in, std::int64_t now_ns, Emit& emit) noexcept override;

  // Emits the frames that wait: the source has ended. RT-safe.
  void flush(Emit& emit) noexcept;

  // All RT-safe; in effect from the next frame that is emitted.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept { return player_.play(order); }
  void stop_playing() noexcept { player_.stop(); }
  void set_model(const BoundModel* model) noexcept;

  // Whether ticks are wanted when nothing comes: frames wait, or something is performed. RT-safe.
  [[nodiscard]] bool waiting() const noexcept { return entered_ != 0 || performs(); }
  [[nodiscard]] bool performs() const noexcept { return player_.busy(); }
  [[nodiscard]] const BoundModel* model() const noexcept { return model_; }

  // Posterior variance of the frame emitted last, one a rotation channel [rad^2]; valid within
  // Emit::frame. RT-safe.
  [[nodiscard]] std::span<const double> variance_rad2() const noexcept {
    return std::span(variance_rad2_).first(channels_);
  }

 private:
  void frame(const Frame& frame) noexcept override;  // out of the smoother
  void show(Frame& frame, const HandAngles* live) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  bool hand_;
  smooth::LiveSmoother smoother_;
  GesturePlayer player_;
  const BoundModel* model_;
  Emit* emit_ = nullptr;  // of the call in progress
  int entered_ = 0;       // frames that wait in the smoother
  bool has_last_ = false;
  bool live_seen_ = false;  // a hand came; else the stream only performs
  Frame last_;              // that went out
  HandAngles live_{};
  std::size_t channels_ = 0;  // of the frame emitted last
  std::array<double, kMaxChannels> variance_rad2_{};
};

}  // namespace posed::generate
