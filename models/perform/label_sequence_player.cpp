#include "models/perform/label_sequence_player.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "models/gesture/play_order.hpp"
#include "models/perform/state_duration.hpp"
#include "models/trajectory/pentadiagonal.hpp"
#include "proto/frame/degree.hpp"

namespace posed::perform {
namespace {

using trajectory::kRows;

constexpr int kSettling = 3;  // frames that a permanent elimination needs (pentadiagonal.hpp)

// The lead-in lasts 1.5 times as long as the farthest channel would need at this speed.
constexpr double kLeadSpeed_rad_s = 300.0 * kDegree;
constexpr double kMinLead_s = 0.2, kMaxLead_s = 0.8;

trajectory::Rows zero_rows(int count, int stride) {
  auto rows = trajectory::make_rows(count, stride);
  std::fill_n(rows.get(), count * stride, 0.0);
  return rows;
}

int frames_in(double seconds, double rate_hz) {
  return static_cast<int>(std::ceil(seconds * rate_hz));
}

// Writes the solver's carry rows for two poses that are known exactly: the information about the
// next two frames through delta-delta windows of precision p2 and mean 0, centred on the second
// pose and on the first frame after it (models/perform/README.md, "Lead-in").
void clamp_to(const double* before, const double* last, int channels, const double* p2,
              double* carry) noexcept {
  const int stride = trajectory::padded(channels);
  for (int c = 0; c < channels; ++c) {
    carry[0 * stride + c] = 5.0 * p2[c];
    carry[1 * stride + c] = -2.0 * p2[c];
    carry[2 * stride + c] = p2[c] * (4.0 * last[c] - before[c]);
    carry[3 * stride + c] = p2[c];
    carry[4 * stride + c] = -p2[c] * last[c];
  }
  for (int row = 0; row < trajectory::kernel::kCarryRows; ++row) {
    std::fill(carry + row * stride + channels, carry + (row + 1) * stride, 0.0);
  }
}

}  // namespace

LabelSequencePlayer::LabelSequencePlayer(double rate_hz, int channels, const PlayerOptions& options)
    : options_(options),
      look_ahead_(std::max(kSettling, frames_in(options.look_ahead_s, rate_hz))),
      script_(options.capacity),
      shown_pose_(channels) {
  const int stride = trajectory::padded(channels);
  const int most = frames_in(kMaxLead_s, rate_hz) + look_ahead_ + 1;
  before_ = zero_rows(1, stride);
  last_ = zero_rows(1, stride);
  out_ = zero_rows(1, stride);
  states_ = zero_rows((2 + look_ahead_) * kRows, stride);
  carry_ = zero_rows(trajectory::kernel::kCarryRows, stride);
  factor_rows_ = zero_rows(most * trajectory::kernel::kFactorRows, stride);
  x_ = zero_rows(most, stride);
  variance_ = zero_rows(1, stride);
  frames_.resize(most);
  factors_.resize(most);
}

LabelSequencePlayer::LabelSequencePlayer(const trajectory::StateInformation& information,
                                         const PlayerOptions& options)
    : LabelSequencePlayer(information.rate_hz(), information.model().channels(), options) {
  begin(information);
}

RT_SAFE void LabelSequencePlayer::begin(const trajectory::StateInformation& information) noexcept {
  information_ = &information;
  channels_ = information.model().channels();
  stride_ = trajectory::padded(channels_);
  for (std::size_t i = 0; i < factors_.size(); ++i) {
    factors_[i] = factor_rows_.get() +
                  static_cast<std::ptrdiff_t>(i) * trajectory::kernel::kFactorRows * stride_;
  }
}

RT_SAFE void LabelSequencePlayer::use(const trajectory::StateInformation& information) noexcept {
  clear();
  begin(information);
}

// The six rows of a slot.
RT_SAFE double* LabelSequencePlayer::slot(int index) noexcept {
  return states_.get() + static_cast<std::ptrdiff_t>(index) * kRows * stride_;
}

RT_SAFE void LabelSequencePlayer::set_tempo(double tempo) noexcept {
  tempo_ = std::clamp(tempo, gesture::kMinTempo, gesture::kMaxTempo);
}

RT_SAFE void LabelSequencePlayer::clear() noexcept {
  script_.clear();
  started_ = false;
}

RT_SAFE void LabelSequencePlayer::start() noexcept {
  assert(script_.empty() || information_ != nullptr);
  started_ = !script_.empty();
  carries_ = false;
  shown_pose_.restart(true);
  lead_left_ = shown_ = 0;
  if (started_) cursor_ = enter(script_, *information_, script_.first(), tempo_);
}

RT_SAFE void LabelSequencePlayer::start(std::span<const double> before,
                                        std::span<const double> last) noexcept {
  start();
  if (!started_) return;
  shown_pose_.restart(false);
  std::copy_n(before.begin(), channels_, before_.get());
  std::copy_n(last.begin(), channels_, last_.get());
  glide();
}

// Starts the lead-in from the last two poses into the cursor's state.
RT_SAFE void LabelSequencePlayer::glide() noexcept {
  double* const lead = slot(0);
  information_->fill(script_.context(cursor_.position), 0, lead);
  double farthest_rad = 0.0;
  for (int c = 0; c < channels_; ++c) {
    const double goal =
        lead[trajectory::kPositionMean * stride_ + c] / lead[trajectory::kPosition * stride_ + c];
    farthest_rad = std::max(farthest_rad, std::abs(goal - last_[c]));
  }
  const double lead_s = std::clamp(1.5 * farthest_rad / kLeadSpeed_rad_s, kMinLead_s, kMaxLead_s);
  lead_left_ = frames_in(lead_s, information_->rate_hz());
  std::fill_n(lead, channels_, 0.0);  // only the first state's delta-delta precision is kept
  std::fill(lead + trajectory::kPositionMean * stride_, lead + trajectory::kDeltaDelta * stride_,
            0.0);
  std::fill(lead + trajectory::kDeltaDeltaMean * stride_, lead + kRows * stride_, 0.0);
  clamp_to(before_.get(), last_.get(), channels_, lead + trajectory::kDeltaDelta * stride_,
           carry_.get());
  carries_ = true;
}

// Writes pointers to the information of the frames that are not final into frames_ and returns
// their number; `shown` becomes the cursor of the frame to output.
RT_SAFE int LabelSequencePlayer::plan(Cursor& shown) noexcept {
  const int most = lead_left_ + look_ahead_ + 1;
  int frames = 0;
  for (; frames < lead_left_; ++frames) frames_[frames] = slot(0);
  Cursor ahead = cursor_;
  int used = 0;
  for (bool entered = true; frames < most; ++frames) {
    if (ahead.frames_left == 0 && !options_.rest && !script_.has_next(ahead.position)) break;
    if (entered) {
      information_->fill(script_.context(ahead.position), ahead.state, slot(++used));
    }
    if (frames == shown_) shown = ahead;
    frames_[frames] = slot(used);
    const Cursor before = ahead;
    step(ahead, script_, *information_, tempo_);
    entered = ahead.state != before.state || ahead.position != before.position;
  }
  return frames;
}

RT_SAFE void LabelSequencePlayer::advance(int frames) noexcept {
  if (frames < kSettling) {
    ++shown_;
    return;
  }
  carries_ = true;
  if (lead_left_ > 0) {
    --lead_left_;
  } else {
    step(cursor_, script_, *information_, tempo_);
    script_.forget_before(cursor_.position);
  }
}

RT_SAFE bool LabelSequencePlayer::next(PlayedFrame& out) noexcept {
  if (!started_) return false;
  if (cursor_.frames_left == 0 &&
      script_.has_next(cursor_.position)) {  // an appended label ends the rest
    step(cursor_, script_, *information_, tempo_);
    glide();
  }
  Cursor shown = cursor_;
  const int frames = plan(shown);
  if (frames <= shown_) return false;
  trajectory::kernel::eliminate({.information = frames_.data(),
                                 .frames = frames,
                                 .stride = stride_,
                                 .carry_in = carries_ ? carry_.get() : nullptr,
                                 .carry_out = frames >= kSettling ? carry_.get() : nullptr},
                                factors_.data());
  trajectory::kernel::substitute(factors_.data(), frames, shown_, stride_, x_.get());
  trajectory::kernel::variance(factors_.data(), frames, shown_, stride_, variance_.get(), 0);
  std::swap(before_, last_);
  std::copy_n(x_.get(), channels_, last_.get());
  const gesture::Context context = script_.context(shown.position);
  if (lead_left_ <= shown_) {
    shown_pose_.advance(*information_, shown.position, context, tempo_);
  }
  for (int c = 0; c < channels_; ++c) out_[c] = last_[c] + shown_pose_.offset_rad(c);
  const std::size_t channels = channels_;
  out.angle = {out_.get(), channels};
  out.variance = {variance_.get(), channels};
  out.label = context.current;
  out.state = lead_left_ > shown_ || shown.frames_left == 0 ? -1 : shown.state;
  advance(frames);
  return true;
}

}  // namespace posed::perform
