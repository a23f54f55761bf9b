// GenerateStage: the live smoother on any skeleton, followed on hands by the gesture player
// (models/generate/README.md, "Pipeline stage"). Frames of a stream that only performs
// (Source::kLabels) are not smoothed and have no lag. For a client a performed frame is a frame
// like any other: it has measured quality and its stream's own sequence numbers and times; its
// source is kLabels, and label and probability name the gesture. One thread.
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
  // `model` is not owned and must outlive its use here; it may be null, and must be null for a
  // skeleton that is not a hand.
  GenerateStage(std::shared_ptr<const Skeleton> skeleton, const smooth::LiveOptions& options,
                double rate_hz, const BoundModel* model);

  // Emits the frames that are due. A tick (null) means that no frame came: the frames that still
  // wait are emitted, and a performance advances by one frame, under the last frame's sequence
  // number. RT-safe.
  void step(const Frame* in, std::int64_t now_ns, Emit& emit) noexcept override;

  // Emits the frames that wait, at the end of the source. RT-safe.
  void flush(Emit& emit) noexcept;

  // All RT-safe; they take effect at the next emitted frame.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept { return player_.play(order); }
  void stop_playing() noexcept { player_.stop(); }
  void set_model(const BoundModel* model) noexcept;

  // Whether ticks are needed when no frames come: frames wait, or a performance runs. RT-safe.
  [[nodiscard]] bool waiting() const noexcept { return entered_ != 0 || performs(); }
  [[nodiscard]] bool performs() const noexcept { return player_.busy(); }
  [[nodiscard]] const BoundModel* model() const noexcept { return model_; }

  // Posterior variance of the last emitted frame, one value per rotation channel [rad^2]; valid
  // within Emit::frame. RT-safe.
  [[nodiscard]] std::span<const double> variance_rad2() const noexcept {
    return std::span(variance_rad2_).first(channels_);
  }

 private:
  void frame(const Frame& frame) noexcept override;  // receives the smoother's output
  void show(Frame& frame, const HandAngles* live) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  bool hand_;
  smooth::LiveSmoother smoother_;
  GesturePlayer player_;
  const BoundModel* model_;
  Emit* emit_ = nullptr;  // of the current call
  int entered_ = 0;       // number of frames that wait in the smoother
  bool has_last_ = false;
  bool live_seen_ = false;  // a live hand was received; else the stream only performs
  Frame last_;              // the last emitted frame
  HandAngles live_{};
  std::size_t channels_ = 0;  // of the last emitted frame
  std::array<double, kMaxChannels> variance_rad2_{};
};

}  // namespace posed::generate
