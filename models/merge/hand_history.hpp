// HandHistory: the newest poses of one glove by their times: 128 of them, a tenth of a second at
// 1000 Hz. One thread; nothing allocates after construction.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "models/merge/hand_pose.hpp"

namespace posed::merge {

class HandHistory {
 public:
  static constexpr std::size_t kPoses = 128;

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  // Call only if there is one. RT-safe.
  [[nodiscard]] const TimedPose& newest() const noexcept { return back(0); }

  void clear() noexcept { count_ = 0; }
  // `pose` is later than the newest; the oldest makes room for it. RT-safe.
  void add(const TimedPose& pose) noexcept {
    next_ = (next_ + 1) % kPoses;
    poses_[next_] = pose;
    if (count_ < kPoses) ++count_;
  }

  // The pose at this time, interpolated between the two around it; beyond the ends the first or the
  // last one as it is. A joint that only one of the two knows is the one of the nearer. The quality
  // is the worse one. Call only if there is one. RT-safe.
  [[nodiscard]] TimedPose pose_at(std::int64_t time_ns) const noexcept {
    if (time_ns >= newest().time_ns) return newest();
    std::size_t i = 1;
    while (i < count_ && back(i).time_ns > time_ns) ++i;
    if (i == count_) return back(count_ - 1);
    const TimedPose& before = back(i);
    const TimedPose& after = back(i - 1);
    const double part = static_cast<double>(time_ns - before.time_ns) /
                        static_cast<double>(after.time_ns - before.time_ns);
    const HandPose& nearer = part < 0.5 ? before.pose : after.pose;
    return {.time_ns = time_ns,
            .quality = part > 0.0 ? std::max(before.quality, after.quality) : before.quality,
            .pose = blend(nearer, before.pose, after.pose, part)};
  }

 private:
  [[nodiscard]] const TimedPose& back(std::size_t i) const noexcept {
    return poses_[(next_ + kPoses - i) % kPoses];
  }

  std::array<TimedPose, kPoses> poses_{};
  std::size_t next_ = 0;  // where the newest is
  std::size_t count_ = 0;
};

}  // namespace posed::merge
