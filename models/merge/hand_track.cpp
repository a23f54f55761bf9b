#include "models/merge/hand_track.hpp"

#include <algorithm>
#include <utility>

namespace posed::merge {
namespace {

constexpr std::int64_t kUsualInterval_ns = 10'000'000;
constexpr std::int64_t kMaxInterval_ns = 100'000'000;
constexpr std::int64_t kSilentIntervals = 4;
// Less than this is the jitter of a radio link, whatever the rate.
constexpr std::int64_t kMinSilence_ns = 20'000'000;
constexpr std::int64_t kIntervalsAveraged = 16;
// A glove whose time goes back by more than this has started again.
constexpr std::int64_t kJumpBack_ns = kNanosPerSecond;

// From 0 to 1 without a jump of the speed.
RT_SAFE double eased(std::int64_t since_ns, std::int64_t length_ns) noexcept {
  const double part =
      std::clamp(static_cast<double>(since_ns) / static_cast<double>(length_ns), 0.0, 1.0);
  return part * part * (3.0 - 2.0 * part);
}

}  // namespace

HandTrack::HandTrack(double rate_hz, std::int64_t hold_ns, const HandPose& relaxed)
    : relaxed_(relaxed),
      hold_ns_(hold_ns),
      interval_ns_(rate_hz > 0.0 ? std::min(nanoseconds(1.0 / rate_hz), kMaxInterval_ns)
                                 : kUsualInterval_ns) {}

RT_SAFE std::int64_t HandTrack::silent_after_ns() const noexcept {
  return std::max(kSilentIntervals * interval_ns_, kMinSilence_ns);
}

RT_SAFE void HandTrack::receive(const TimedPose& pose, std::int64_t now_ns) noexcept {
  received_ns_ = std::max(received_ns_, now_ns);
  if (!history_.empty()) {
    const std::int64_t step_ns = pose.time_ns - history_.newest().time_ns;
    if (step_ns <= 0 && step_ns > -kJumpBack_ns) return;
    if (step_ns < 0 || step_ns > silent_after_ns()) {
      returns_ = has_shown_;
      left_ns_ = shown_ns_;
      left_ = shown_;
    }
    if (step_ns < 0) history_.clear();
    const std::int64_t interval_ns = std::clamp<std::int64_t>(step_ns, 0, kMaxInterval_ns);
    if (step_ns > 0) interval_ns_ += (interval_ns - interval_ns_) / kIntervalsAveraged;
  }
  history_.add(pose);
}

// What the glove says of this time, or is assumed to say.
RT_SAFE TimedPose HandTrack::source_pose(std::int64_t time_ns) noexcept {
  TimedPose at = history_.pose_at(time_ns);
  const std::int64_t before_ns = std::exchange(used_ns_, at.time_ns);
  if (at.time_ns >= time_ns) return at;
  const std::int64_t silent_ns = time_ns - at.time_ns - hold_ns_;
  if (silent_ns > 0) {
    at.pose = blend(at.pose, at.pose, relaxed_, eased(silent_ns, kRelax_ns));
    at.quality = Quality::kPredicted;
  } else if (before_ns == at.time_ns) {
    at.quality = std::max(at.quality, Quality::kHeld);
  }
  return at;
}

RT_SAFE std::optional<TimedPose> HandTrack::pose_at(std::int64_t time_ns) noexcept {
  if (history_.empty()) return std::nullopt;
  TimedPose at = source_pose(time_ns);
  if (returns_) {
    at.pose = blend(at.pose, left_, at.pose, eased(time_ns - left_ns_, kReturn_ns));
    returns_ = time_ns - left_ns_ < kReturn_ns;
  }
  has_shown_ = true;
  shown_ns_ = time_ns;
  shown_ = at.pose;
  return at;
}

}  // namespace posed::merge
