#include "models/perform/shown_pose.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace posed::perform {
namespace {

// The states in which a pose is held, from 0; the longer one is where it has come to rest.
constexpr int kHeldFrom = 2, kHeldTo = 3;
constexpr double kLeave_s = 11.0 / 30.0;  // from a shown pose into the next label

trajectory::Rows zeros(int stride) {
  auto rows = trajectory::make_rows(1, stride);
  std::fill_n(rows.get(), stride, 0.0);
  return rows;
}

}  // namespace

ShownPose::ShownPose(int channels)
    : most_(trajectory::padded(channels)),
      goal_(zeros(most_)),
      from_(zeros(most_)),
      speed_(zeros(most_)),
      now_(zeros(most_)),
      scratch_(trajectory::make_rows(trajectory::kRows, most_)) {}

RT_SAFE void ShownPose::restart(bool poses) noexcept {
  for (const trajectory::Rows* rows : {&goal_, &from_, &speed_, &now_}) {
    std::fill_n(rows->get(), most_, 0.0);
  }
  position_ = -1;
  at_once_ = poses;
  moves_ = false;
}

// The offset from where the label is held to what was shown.
RT_SAFE void ShownPose::aim(const trajectory::StateInformation& information,
                            const gesture::Context& context, double tempo,
                            const double* held) noexcept {
  const std::span<const double> shown =
      information.model().labels[static_cast<std::size_t>(context.current)].shown;
  const int channels = information.model().channels();
  const int stride = trajectory::padded(channels);
  // From where the offset is, at its speed, to the new goal.
  const double t = std::min(1.0, static_cast<double>(frame_) / frames_);
  const double rest = 1.0 - t;
  for (int c = 0; c < channels; ++c) {
    const double way = from_[c] - goal_[c];
    const double speed = -30.0 * way * t * t * rest * rest +
                         speed_[c] * (1.0 + t * t * (-18.0 + t * (32.0 - 15.0 * t)));
    speed_[c] = speed / frames_;  // a frame
    from_[c] = now_[c];
    goal_[c] = 0.0;
  }
  frames_ = std::max(1, static_cast<int>(std::lround(kLeave_s * information.rate_hz() / tempo)));
  if (!shown.empty()) {
    const gesture::DurationGaussian duration = information.duration(context);
    const bool later = duration.mean[kHeldTo] > duration.mean[kHeldFrom];
    information.fill(context, later ? kHeldTo : kHeldFrom, scratch_.get());
    for (int c = 0; c < channels; ++c) {
      const double mean = scratch_[trajectory::kPositionMean * stride + c] /
                          scratch_[trajectory::kPosition * stride + c];
      goal_[c] = shown[static_cast<std::size_t>(c)] - (held != nullptr ? held[c] : mean);
    }
    frames_ =
        std::max(1, static_cast<int>(std::lround((duration.mean[0] + duration.mean[1]) / tempo)));
  }
  moves_ = false;
  for (int c = 0; c < channels; ++c) {
    speed_[c] *= frames_;  // a ramp
    moves_ = moves_ || goal_[c] != 0.0 || from_[c] != 0.0;
  }
  frame_ = 0;
}

RT_SAFE void ShownPose::advance(const trajectory::StateInformation& information, long position,
                                const gesture::Context& context, double tempo,
                                const double* held) noexcept {
  if (position != position_) {
    aim(information, context, tempo, held);
    position_ = position;
    if (at_once_) frame_ = frames_;
    at_once_ = false;
  }
  if (!moves_) return;
  frame_ = std::min(frame_ + 1, frames_);
  const double t = static_cast<double>(frame_) / frames_;
  const double left = 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t));
  const double lead = t * (1.0 + t * t * (-6.0 + t * (8.0 - 3.0 * t)));
  const int channels = information.model().channels();
  for (int c = 0; c < channels; ++c) {
    now_[c] = goal_[c] + (from_[c] - goal_[c]) * left + speed_[c] * lead;
  }
}

}  // namespace posed::perform
