// HandTrack: what one glove has measured so far, and the hand pose that a body gets at any time.
// While the glove measures, that is its pose at this time; when it falls silent, the last pose is
// held and then eases to a relaxed hand; when it comes back, the hand eases back (README.md). It
// knows only the times that are passed to it. One thread; nothing allocates after construction.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "models/merge/hand_map.hpp"

namespace posed::merge {

// The newest poses of one glove by their times: 128 of them, a tenth of a second at
// 1000 Hz. One thread; nothing allocates after construction.
class HandHistory {
 public:
  static constexpr std::size_t kPoses = 128;

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  // Call only if there is one.
  RT_SAFE [[nodiscard]] const TimedPose& newest() const noexcept {
    assert(!empty());
    return back(0);
  }

  void clear() noexcept { count_ = 0; }
  // `pose` is later than the newest; the oldest makes room for it.
  RT_SAFE void add(const TimedPose& pose) noexcept {
    assert(empty() || pose.time_ns > newest().time_ns);
    next_ = (next_ + 1) % kPoses;
    poses_[next_] = pose;
    if (count_ < kPoses) ++count_;
  }

  // The pose at this time, interpolated between the two around it; beyond the ends the first or the
  // last one as it is. A joint that only one of the two knows is the one of the nearer. The quality
  // is the worse one. Call only if there is one.
  RT_SAFE [[nodiscard]] TimedPose pose_at(std::int64_t time_ns) const noexcept {
    assert(!empty());
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

class HandTrack {
 public:
  static constexpr std::int64_t kRelax_ns = 500'000'000;   // from the held pose to the relaxed one
  static constexpr std::int64_t kReturn_ns = 100'000'000;  // from there to what the glove measures

  // `rate_hz` of the glove, 0 when unknown; later it is measured. `relaxed`: a hand at rest.
  HandTrack(double rate_hz, std::int64_t hold_ns, const HandPose& relaxed);

  // The body has begun at `now_ns`; from now on the glove is expected.
  RT_SAFE void begin(std::int64_t now_ns) noexcept {
    if (received_ns_ == kNoTime_ns) received_ns_ = now_ns;
  }
  // The glove's next pose, which came at `now_ns`. A pose that is not later than the newest one is
  // ignored, unless the glove's time has jumped back.
  RT_SAFE void receive(const TimedPose& pose, std::int64_t now_ns) noexcept;

  // Whether a body's frame of this time is better with the glove's next pose, and the glove has not
  // been silent for so long that none is likely to come.
  RT_SAFE [[nodiscard]] bool awaited(std::int64_t time_ns, std::int64_t now_ns) const noexcept {
    const bool here = !history_.empty() && history_.newest().time_ns >= time_ns;
    return !here && received_ns_ != kNoTime_ns && now_ns - received_ns_ < silent_after_ns();
  }
  // The pose for a body's frame; empty as long as the glove has not measured any. Times do not
  // decrease.
  RT_SAFE [[nodiscard]] std::optional<TimedPose> pose_at(std::int64_t time_ns) noexcept;

  // Without a frame for so long the glove counts as silent.
  RT_SAFE [[nodiscard]] std::int64_t silent_after_ns() const noexcept;

 private:
  [[nodiscard]] TimedPose source_pose(std::int64_t time_ns) noexcept;

  HandHistory history_;
  HandPose relaxed_;
  std::int64_t hold_ns_;
  std::int64_t interval_ns_;               // between two of the glove's frames, smoothed
  std::int64_t received_ns_ = kNoTime_ns;  // when the last of them came
  std::int64_t used_ns_ = kNoTime_ns;      // time of the measurement that the last frame got
  // What the last frame got, and what the hand eases back from.
  bool has_shown_ = false, returns_ = false;
  std::int64_t shown_ns_ = 0, left_ns_ = 0;
  HandPose shown_, left_;
};

}  // namespace posed::merge
