// GesturePlayer: performs label strings on a hand, and leads from the live hand into them and back
// (models/generate/README.md, "Gesture player"): in by the player's lead-in, from the hand's last
// two poses; back by the live hand plus a decaying offset. The script is the future, so there is no
// lag. Frames are the stream's own, at the rate that the model is bound to.
//
// Without a live hand (a stream that only performs) it holds its last pose between performances.
#pragma once

#include <array>
#include <cstdint>

#include "models/generate/bound_model.hpp"
#include "models/generate/quintic_offset.hpp"
#include "models/gesture/play_order.hpp"

namespace posed::generate {

// RT-safe; one thread.
class GesturePlayer {
 public:
  explicit GesturePlayer(double rate_hz) noexcept : rate_hz_(rate_hz) {}

  // Ends what is performed, as stop() does; the old model is no longer read. May be null.
  void set_model(const BoundModel* model) noexcept;

  // Performs these labels after those that wait; its tempo counts from the next state on. A loop
  // ends with the labels that are planned ahead already. False: without a model, with labels that
  // it has not, or with no room for so many.
  [[nodiscard]] bool play(const gesture::PlayOrder& order) noexcept;
  // Back to the live hand, from where it is.
  void stop() noexcept;

  // One frame. `live` is the hand at this frame, finite; null: there is none. Returns the pose to
  // show, and what it is.
  enum class What : std::uint8_t { kLive, kHeld, kPerformed, kLeadingBack };
  struct Pose {
    What what = What::kLive;
    int label = -1;  // index into the model's labels while performed
    HandAngles angles{};
    HandAngles variance_rad2{};  // 0 where it is not a performance's
  };
  [[nodiscard]] const Pose& step(const HandAngles* live) noexcept;

  // Whether the next step would show anything but the live or held hand.
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

  int ahead_ = 0;            // labels that wait in the player
  gesture::PlayOrder loop_;  // what begins again; empty: nothing
  int loop_next_ = 0;
  perform::PlayedFrame played_;

  QuinticOffset way_back_;
  HandAngles hold_{};                 // what is shown without a live hand
  std::array<HandAngles, 2> past_{};  // the last two poses shown, newest last
  std::array<HandAngles, 2> live_{};  // the last two live ones
  Pose pose_;
};

}  // namespace posed::generate
