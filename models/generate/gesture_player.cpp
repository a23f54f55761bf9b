#include "models/generate/gesture_player.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace posed::generate {
namespace {

constexpr double kWayBack_s = 0.8;
// Look-ahead into the label sequence: with 20 frames at 30 Hz the jerk of a streamed trajectory is
// within 3 % of the full solution's (models/trajectory/README.md, "Look-ahead").
constexpr double kLookAhead_s = 20.0 / 30.0;
// Labels of a loop that are planned ahead: those within the look-ahead, and one neighbour.
constexpr int kLoopAhead = 3;

}  // namespace

GesturePlayer::GesturePlayer(double rate_hz)
    : rate_hz_(rate_hz),
      player_(rate_hz, {.look_ahead_s = kLookAhead_s, .capacity = kMaxWaiting + 4}) {}

// RT-safe.
void GesturePlayer::set_model(const BoundModel* model) noexcept {
  stop();
  model_ = model;
  if (model_ != nullptr) player_.use(model_->information);
}

// RT-safe.
bool GesturePlayer::play(const gesture::PlayOrder& order) noexcept {
  if (model_ == nullptr || order.size == 0 || order.size > order.label.size()) return false;
  if (order.size > kMaxWaiting - ahead_) return false;
  const std::size_t known = model_->gesture().labels.size();
  const auto is_known = [known](std::uint16_t label) { return label < known; };
  if (!std::ranges::all_of(order.labels(), is_known)) return false;
  if (stopping_) {  // the stopped performance is dropped, even while the hand is led back
    player_.clear();
    phase_ = Phase::kIdle;
    stopping_ = false;
  }
  for (const std::uint16_t label : order.labels()) append(label);
  loop_.size = 0;
  loop_next_ = 0;
  if (order.loop) loop_ = order;
  player_.set_tempo(order.tempo);
  return true;
}

// RT-safe.
void GesturePlayer::append(int label) noexcept {
  if (player_.add(label)) ++ahead_;
}

// RT-safe.
void GesturePlayer::stop() noexcept {
  player_.clear();
  ahead_ = 0;
  loop_.size = 0;
  stopping_ = phase_ == Phase::kPerforming;
}

// RT-safe.
const GesturePlayer::Pose& GesturePlayer::step(const HandAngles* live) noexcept {
  if (!std::exchange(started_, true) && live != nullptr) {
    past_.fill(*live);
    live_.fill(*live);
  }
  if (phase_ == Phase::kPerforming && (stopping_ || !next_performed())) {
    begin_way_back(live != nullptr);
  }
  if (phase_ != Phase::kPerforming && ahead_ > 0) {
    player_.start(past_[0], past_[1]);
    phase_ = next_performed() ? Phase::kPerforming : Phase::kIdle;
  }
  if (live != nullptr) live_ = {live_[1], *live};
  pose_.label = -1;
  pose_.variance_rad2.fill(0.0);
  pose_.angles = live != nullptr ? *live : hold_;
  if (phase_ == Phase::kIdle) {
    pose_.what = live != nullptr ? What::kLive : What::kHeld;
  } else if (phase_ == Phase::kPerforming) {
    pose_ = {What::kPerformed, played_.label, played_.angle, played_.variance};
  } else {
    pose_.what = What::kLeadingBack;
    const HandAngles offset = way_back_.next();
    for (std::size_t c = 0; c < offset.size(); ++c) pose_.angles[c] += offset[c];
    if (way_back_.done()) phase_ = Phase::kIdle;
  }
  past_ = {past_[1], pose_.angles};
  return pose_;
}

// RT-safe.
bool GesturePlayer::next_performed() noexcept {
  keep_looping();
  const int before = played_.state;
  if (!player_.next(played_)) return false;
  if (played_.state == 0 && before != 0) --ahead_;  // the next label begins
  return true;
}

// RT-safe.
void GesturePlayer::keep_looping() noexcept {
  while (loop_.size > 0 && ahead_ < kLoopAhead) {
    append(loop_.label[static_cast<std::size_t>(loop_next_)]);
    loop_next_ = (loop_next_ + 1) % loop_.size;
  }
}

// RT-safe.
void GesturePlayer::begin_way_back(bool live) noexcept {
  stopping_ = false;
  player_.clear();
  ahead_ = 0;
  played_.state = -1;
  hold_ = past_[1];
  if (!live) live_ = {hold_, hold_};
  HandAngles offset, velocity;
  for (std::size_t c = 0; c < offset.size(); ++c) {
    offset[c] = past_[1][c] - live_[1][c];
    velocity[c] = (past_[1][c] - past_[0][c]) - (live_[1][c] - live_[0][c]);
  }
  way_back_.start(offset, velocity, static_cast<int>(std::ceil(kWayBack_s * rate_hz_)));
  phase_ = Phase::kLeadingBack;
}

}  // namespace posed::generate
