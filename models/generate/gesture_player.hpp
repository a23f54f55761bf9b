// GesturePlayer: performs label sequences on a hand or a body, and leads from the live pose into
// them and back (models/generate/README.md, "Gesture player"). The way in is the lead-in of
// LabelSequencePlayer, from the last two poses shown; the way back is the live pose plus a decaying
// offset. The future is the label sequence, so there is no lag. Frames are those of the stream, at
// the rate to which the model is bound. A pose has the channels of the model, [channel] in radians.
//
// Without a live pose (a stream that only performs) it holds its last one between performances.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "models/generate/bound_model.hpp"
#include "models/gesture/play_order.hpp"
#include "models/perform/label_sequence_player.hpp"

namespace posed::generate {

// The return from a performance to the live hand (models/generate/README.md, "Return to the live
// hand"). It is an offset that decays from an initial position and velocity to zero along a
// polynomial of fifth degree, which starts without acceleration and ends at rest. Added to the live
// pose, it leads back to it. RT-safe except for construction.
class QuinticOffset {
 public:
  // Allocates for poses of at most `channels` channels.
  explicit QuinticOffset(int channels) : offset_(channels), velocity_(channels) {}

  // [channel]; `velocity` is in radians per frame; the offset is zero after `frames` frames.
  void start(std::span<const double> offset, std::span<const double> velocity, int frames) noexcept;

  // Adds the next frame's offset to a pose, the first call that of a frame after the start; zero
  // when done().
  void add_next(std::span<double> pose) noexcept;
  [[nodiscard]] bool done() const noexcept { return frame_ >= frames_; }

 private:
  std::vector<double> offset_, velocity_;
  int frame_ = 0, frames_ = 0;
};

// One thread.
class GesturePlayer {
 public:
  // Allocates; all else is RT-safe. `rate_hz` is that of the models, too, and `channels` the most
  // that one of them has; until the first model, poses have so many.
  GesturePlayer(double rate_hz, int channels);

  // Ends the performance as stop() does; the old model is no longer read. May be null.
  void set_model(const BoundModel* model) noexcept;
  // The pose from which it goes on, in the channels of the model in use: where a body stands that
  // only performs, and the pose shown last after a model with other channels.
  void go_on_from(std::span<const double> pose) noexcept;

  // Performs these labels after those that wait; the order's tempo applies from the next state on.
  // A loop that is running ends after the labels already planned ahead. Returns false without a
  // model, with label indices that the model does not have, or when too many labels would wait.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept;
  // Leads back to the live pose at once, from the present one.
  void stop() noexcept;

  // Advances by a frame. `live` is the pose at this frame, finite; empty: there is no live one.
  // Returns the pose to show, valid until the next call, and its kind.
  enum class What : std::uint8_t { kLive, kHeld, kPerformed, kLeadingBack };
  struct Pose {
    What what = What::kLive;
    int label = -1;  // index into the model's labels while performing, else -1
    std::span<const double> angles{};
    std::span<const double> variance_rad2{};  // empty unless performed
  };
  [[nodiscard]] Pose step(std::span<const double> live) noexcept;

  // Whether the next step shows anything other than the live or held pose.
  [[nodiscard]] bool busy() const noexcept { return phase_ != Phase::kIdle || ahead_ > 0; }

 private:
  enum class Phase : std::uint8_t { kIdle, kPerforming, kLeadingBack };

  void append(int label) noexcept;
  void keep_looping() noexcept;
  void begin_way_back(bool live) noexcept;
  [[nodiscard]] bool next_performed() noexcept;
  [[nodiscard]] std::span<double> used(std::vector<double>& pose) const noexcept {
    return std::span(pose).first(channels_);
  }

  double rate_hz_;
  std::size_t channels_;
  const BoundModel* model_ = nullptr;
  Phase phase_ = Phase::kIdle;
  bool started_ = false;     // past_ holds poses
  bool live_known_ = false;  // live_ holds poses
  bool stopping_ = false;

  perform::LabelSequencePlayer player_;
  int ahead_ = 0;            // number of labels that wait in the player
  gesture::PlayOrder loop_;  // the order that repeats; empty: none
  int loop_next_ = 0;
  perform::PlayedFrame played_;

  QuinticOffset way_back_;
  // [channel]
  std::vector<double> hold_;                 // the pose shown without a live one
  std::array<std::vector<double>, 2> past_;  // the last two poses shown, newest last
  std::array<std::vector<double>, 2> live_;  // the last two live ones
  std::vector<double> shown_;                // the pose of this step
  std::vector<double> offset_, velocity_;    // where the way back begins
};

}  // namespace posed::generate
