// GesturePlayer: performs label sequences on a hand, and leads from the live hand into them and
// back (models/generate/README.md, "Gesture player"). The way in is the lead-in of
// LabelSequencePlayer, from the hand's last two poses; the way back is the live hand plus a
// decaying offset. The future is the label sequence, so there is no lag. Frames are those of the
// stream, at the rate to which the model is bound.
//
// Without a live hand (a stream that only performs) it holds its last pose between performances.
#pragma once

#include <array>
#include <cstdint>

#include "models/generate/bound_model.hpp"
#include "models/generate/quintic_offset.hpp"
#include "models/gesture/play_order.hpp"
#include "models/perform/label_sequence_player.hpp"

namespace posed::generate {

// One thread.
class GesturePlayer {
 public:
  // Allocates; all else is RT-safe. `rate_hz` is that of the models, too.
  explicit GesturePlayer(double rate_hz);

  // Ends the performance as stop() does; the old model is no longer read. May be null.
  void set_model(const BoundModel* model) noexcept;

  // Performs these labels after those that wait; the order's tempo applies from the next state on.
  // A loop that is running ends after the labels already planned ahead. Returns false without a
  // model, with label indices that the model does not have, or when too many labels would wait.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept;
  // Leads back to the live hand at once, from the present pose.
  void stop() noexcept;

  // One frame. `live` is the hand at this frame, with finite angles; null: there is no live hand.
  // Returns the pose to show and its kind.
  enum class What : std::uint8_t { kLive, kHeld, kPerformed, kLeadingBack };
  struct Pose {
    What what = What::kLive;
    int label = -1;  // index into the model's labels while performing, else -1
    HandAngles angles{};
    HandAngles variance_rad2{};  // 0 unless performed
  };
  [[nodiscard]] const Pose& step(const HandAngles* live) noexcept;

  // Whether the next step shows anything other than the live or held hand.
  [[nodiscard]] bool busy() const noexcept { return phase_ != Phase::kIdle || ahead_ > 0; }

 private:
  enum class Phase : std::uint8_t { kIdle, kPerforming, kLeadingBack };

  void append(int label) noexcept;
  void keep_looping() noexcept;
  void begin_way_back(bool live) noexcept;
  [[nodiscard]] bool next_performed() noexcept;

  double rate_hz_;
  const BoundModel* model_ = nullptr;
  Phase phase_ = Phase::kIdle;
  bool started_ = false;  // past_ holds poses
  bool stopping_ = false;

  perform::LabelSequencePlayer player_;
  int ahead_ = 0;            // number of labels that wait in the player
  gesture::PlayOrder loop_;  // the order that repeats; empty: none
  int loop_next_ = 0;
  perform::PlayedFrame played_;

  QuinticOffset way_back_;
  HandAngles hold_{};                 // the pose shown without a live hand
  std::array<HandAngles, 2> past_{};  // the last two poses shown, newest last
  std::array<HandAngles, 2> live_{};  // the last two live ones
  Pose pose_;
};

}  // namespace posed::generate
