// GenerateStage: the live smoother on any skeleton, followed on hands, and on bodies with a gesture
// model, by the gesture player (models/generate/README.md, "Pipeline stage"). Frames of a stream
// that only performs (Source::kLabels) are not smoothed and have no lag. For a client a performed
// frame is a frame like any other: it has measured quality and its stream's own sequence numbers
// and times; its source is kLabels, and label and probability name the gesture. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "models/elapsed.hpp"
#include "models/generate/bound_model.hpp"
#include "models/generate/gesture_player.hpp"
#include "models/gesture/pose_channels.hpp"
#include "models/motion/heading.hpp"
#include "models/perform/standing.hpp"
#include "models/smooth/live_options.hpp"
#include "models/smooth/live_smoother.hpp"
#include "models/stage_type.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::generate {

class GenerateStage final : public Stage {
 public:
  // The commands, as generate_type() numbers them: labels to perform (a gesture::PlayOrder), and
  // back to the live hand.
  enum Command : std::size_t { kPlay, kStopPlaying };

  // `model` is bound to the skeleton, not owned, and must outlive its use here; it may be null.
  GenerateStage(std::shared_ptr<const Skeleton> skeleton, const smooth::LiveOptions& options,
                double rate_hz, const BoundModel* model);

  // Emits the frames that are due.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;
  // Frames that wait go out after a few frames' silence, and a performance goes on at the stream's
  // rate, under the last frame's sequence.
  RT_SAFE void received(std::int64_t arrival_ns) noexcept override;
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  void tick(std::int64_t now_ns, StageOut& out) noexcept override;
  // Emits the frames that wait: the source has ended.
  RT_SAFE void flush(StageOut& out) noexcept override;
  [[nodiscard]] bool performs() const noexcept override { return player_.busy(); }

  RT_SAFE bool use(const StageModel* model) noexcept override;
  [[nodiscard]] const BoundModel* model() const noexcept override { return model_; }
  [[nodiscard]] bool command(std::size_t index, const StageCommand& command) noexcept override;
  void describe(std::size_t index, const StageCommand& command,
                ShortText& text) const noexcept override;

 private:
  // Where the smoother puts its frames.
  class Smoothed;

  void smoothed(const StageFrame& frame, StageOut& out) noexcept;
  void rest(const StageFrame& in, StageOut& out) noexcept;
  void follow(const Frame& frame) noexcept;
  void show(Frame& frame, std::span<const double> live, StageOut& out) noexcept;
  void pose(const GesturePlayer::Pose& shown, Frame& frame) noexcept;
  void use_channels() noexcept;
  [[nodiscard]] std::span<double> used(std::vector<double>& values) const noexcept {
    return std::span(values).first(pose_channels_->count());
  }
  // Variances of the frame that goes out.
  [[nodiscard]] std::span<const double> variance_rad2() const noexcept {
    return std::span(variance_rad2_).first(channels_);
  }

  std::shared_ptr<const Skeleton> skeleton_;
  std::optional<gesture::PoseChannels> hand_;  // empty: a body
  std::optional<perform::Standing> standing_;  // of a body
  smooth::LiveSmoother smoother_;
  GesturePlayer player_;
  const BoundModel* model_;
  const gesture::PoseChannels* pose_channels_ = nullptr;  // null: a body without a model
  Elapsed elapsed_;
  motion::LiveHeading heading_;  // used for a body
  std::int64_t period_ns_;       // between frames performed in silence
  std::int64_t last_received_ns_ = kNoTime_ns;
  std::int64_t last_tick_ns_ = kNoTime_ns;  // in this silence
  int entered_ = 0;                         // frames that wait in the smoother
  bool has_last_ = false;
  bool live_seen_ = false;           // a live pose was received; else the stream only performs
  Frame last_;                       // the last emitted frame
  std::vector<double> live_, read_;  // [channel] the live pose; of the frame that comes
  std::size_t channels_ = 0;         // of the last emitted frame
  std::array<double, kMaxChannels> variance_rad2_{};
};

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& generate_type();

}  // namespace posed::generate
