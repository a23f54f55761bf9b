#include "models/perform/label_sequence.hpp"

#include <algorithm>
#include <cassert>

#include "models/perform/state_duration.hpp"

namespace posed::perform {
namespace {

// Sets the duration of the cursor's state. At a tempo other than 1 the rounding error is carried to
// the next state, so that a long sequence does not drift from its tempo.
void begin_state(Cursor& cursor, const LabelSequence& script,
                 const trajectory::StateInformation& information, double tempo) noexcept {
  const gesture::DurationGaussian duration = information.duration(script.context(cursor.position));
  const double mean = duration.mean[cursor.state];
  const double variance = duration.variance[cursor.state];
  const double rho = tempo_rho(duration, tempo);
  const double carried = tempo == 1.0 ? 0.0 : cursor.carried;
  cursor.frames = cursor.frames_left = state_frames(mean, variance, rho, carried);
  if (tempo != 1.0) cursor.carried += std::max(1.0, mean + rho * variance) - cursor.frames;
}

}  // namespace

LabelSequence::LabelSequence(int capacity) : labels_(capacity) {}

RT_SAFE bool LabelSequence::append(int label) noexcept {
  const auto capacity = static_cast<long>(labels_.size());
  if (end_ - first_ == capacity) return false;
  labels_[end_ % capacity] = label;
  ++end_;
  return true;
}

RT_SAFE void LabelSequence::clear() noexcept { first_ = end_; }

RT_SAFE bool LabelSequence::has_next(long position) const noexcept {
  return position + 1 < end_ || (loop_ && !empty());
}

RT_SAFE long LabelSequence::next(long position) const noexcept {
  assert(has_next(position));
  return position + 1 < end_ ? position + 1 : first_;
}

RT_SAFE gesture::Context LabelSequence::context(long position) const noexcept {
  const int current = label(position);
  const int previous = position > first_ ? label(position - 1) : loop_ ? label(end_ - 1) : current;
  return {previous, current, has_next(position) ? label(next(position)) : current};
}

RT_SAFE void LabelSequence::forget_before(long position) noexcept {
  if (!loop_) first_ = std::max(first_, position - 1);
}

RT_SAFE Cursor enter(const LabelSequence& script, const trajectory::StateInformation& information,
                     long position, double tempo) noexcept {
  Cursor cursor{.position = position};
  begin_state(cursor, script, information, tempo);
  return cursor;
}

RT_SAFE void step(Cursor& cursor, const LabelSequence& script,
                  const trajectory::StateInformation& information, double tempo) noexcept {
  if (cursor.frames_left > 1) {
    --cursor.frames_left;
    return;
  }
  if (cursor.state + 1 < gesture::kStates) {
    ++cursor.state;
  } else if (script.has_next(cursor.position)) {
    cursor.position = script.next(cursor.position);
    cursor.state = 0;
  } else {
    cursor.frames_left = 0;
    return;
  }
  begin_state(cursor, script, information, tempo);
}

}  // namespace posed::perform
