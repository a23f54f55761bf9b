#include "models/generate/gesture_player.hpp"

#include <algorithm>
#include <cassert>
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

RT_SAFE void QuinticOffset::start(std::span<const double> offset, std::span<const double> velocity,
                                  int frames) noexcept {
  assert(frames > 0 && offset.size() <= offset_.size() && velocity.size() <= velocity_.size());
  std::ranges::copy(offset, offset_.begin());
  std::ranges::copy(velocity, velocity_.begin());
  frame_ = 0;
  frames_ = frames;
}

RT_SAFE void QuinticOffset::add_next(std::span<double> pose) noexcept {
  if (done()) return;
  ++frame_;
  const double t = static_cast<double>(frame_) / frames_;
  const double t3 = t * t * t;
  const double of_position = 1.0 - t3 * (10.0 - t * (15.0 - 6.0 * t));
  const double of_velocity = frames_ * (t - t3 * (6.0 - t * (8.0 - 3.0 * t)));
  for (std::size_t c = 0; c < pose.size(); ++c) {
    pose[c] += of_position * offset_[c] + of_velocity * velocity_[c];
  }
}

GesturePlayer::GesturePlayer(double rate_hz, int channels)
    : rate_hz_(rate_hz),
      channels_(channels),
      player_(rate_hz, channels, {.look_ahead_s = kLookAhead_s, .capacity = kMaxWaiting + 4}),
      way_back_(channels) {
  for (auto* pose :
       {&hold_, &past_[0], &past_[1], &live_[0], &live_[1], &shown_, &offset_, &velocity_}) {
    pose->assign(channels_, 0.0);
  }
}

RT_SAFE void GesturePlayer::set_model(const BoundModel* model) noexcept {
  stop();
  model_ = model;
  if (model_ == nullptr) return;
  player_.use(model_->information);
  channels_ = static_cast<std::size_t>(model_->gesture().channels());
}

RT_SAFE void GesturePlayer::go_on_from(std::span<const double> pose) noexcept {
  started_ = true;
  live_known_ = false;
  for (auto* known : {&hold_, &past_[0], &past_[1]}) std::ranges::copy(pose, known->begin());
  // What is left of a performance is not in these channels: the way back begins anew.
  stopping_ = phase_ != Phase::kIdle;
  if (stopping_) phase_ = Phase::kPerforming;
}

RT_SAFE bool GesturePlayer::play(const gesture::PlayOrder& order) noexcept {
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

RT_SAFE void GesturePlayer::append(int label) noexcept {
  if (player_.add(label)) ++ahead_;
}

RT_SAFE void GesturePlayer::stop() noexcept {
  player_.clear();
  ahead_ = 0;
  loop_.size = 0;
  stopping_ = phase_ == Phase::kPerforming;
}

RT_SAFE GesturePlayer::Pose GesturePlayer::step(std::span<const double> live) noexcept {
  const bool is_live = !live.empty();
  if (is_live && !std::exchange(live_known_, true)) {
    for (auto& pose : live_) std::ranges::copy(live, pose.begin());
  }
  if (!std::exchange(started_, true) && is_live) {
    for (auto& pose : past_) std::ranges::copy(live, pose.begin());
  }
  if (phase_ == Phase::kPerforming && (stopping_ || !next_performed())) begin_way_back(is_live);
  if (phase_ != Phase::kPerforming && ahead_ > 0) {
    player_.start(used(past_[0]), used(past_[1]));
    phase_ = next_performed() ? Phase::kPerforming : Phase::kIdle;
  }
  if (is_live) {
    std::swap(live_[0], live_[1]);
    std::ranges::copy(live, live_[1].begin());
  }
  Pose pose{.angles = used(shown_)};
  std::ranges::copy(is_live ? live : std::span<const double>(used(hold_)), shown_.begin());
  if (phase_ == Phase::kIdle) {
    pose.what = is_live ? What::kLive : What::kHeld;
  } else if (phase_ == Phase::kPerforming) {
    pose.what = What::kPerformed;
    pose.label = played_.label;
    pose.variance_rad2 = played_.variance;
    std::ranges::copy(played_.angle, shown_.begin());
  } else {
    pose.what = What::kLeadingBack;
    way_back_.add_next(used(shown_));
    if (way_back_.done()) phase_ = Phase::kIdle;
  }
  std::swap(past_[0], past_[1]);
  std::ranges::copy(pose.angles, past_[1].begin());
  return pose;
}

RT_SAFE bool GesturePlayer::next_performed() noexcept {
  keep_looping();
  const int before = played_.state;
  if (!player_.next(played_)) return false;
  if (played_.state == 0 && before != 0) --ahead_;  // the next label begins
  return true;
}

RT_SAFE void GesturePlayer::keep_looping() noexcept {
  while (loop_.size > 0 && ahead_ < kLoopAhead) {
    append(loop_.label[loop_next_]);
    loop_next_ = (loop_next_ + 1) % loop_.size;
  }
}

RT_SAFE void GesturePlayer::begin_way_back(bool live) noexcept {
  stopping_ = false;
  player_.clear();
  ahead_ = 0;
  played_.state = -1;
  std::ranges::copy(past_[1], hold_.begin());
  if (!live) {
    for (auto& pose : live_) std::ranges::copy(hold_, pose.begin());
  }
  for (std::size_t c = 0; c < channels_; ++c) {
    offset_[c] = past_[1][c] - live_[1][c];
    velocity_[c] = (past_[1][c] - past_[0][c]) - (live_[1][c] - live_[0][c]);
  }
  way_back_.start(used(offset_), used(velocity_),
                  static_cast<int>(std::ceil(kWayBack_s * rate_hz_)));
  phase_ = Phase::kLeadingBack;
}

}  // namespace posed::generate
