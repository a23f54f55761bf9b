// FrameClock: seconds that a solver can rely on, out of the times that frames bring. Device times
// are taken at their word; arrival times of an even stream come in bursts and are drawn towards the
// stream's own beat. Steps are never shorter than half the beat, so that two frames which arrived
// together do not look like infinite speed, and times that run backwards count as one beat.
#pragma once

#include <array>
#include <cstdint>

#include "proto/frame/frame.hpp"

namespace posed::smooth {

class FrameClock {
 public:
  // Seconds since the first frame; strictly increasing. RT-safe.
  double tick(const Header& header) noexcept;

  // The stream's beat: the median of the last steps [s]; 0 before there is one. RT-safe.
  [[nodiscard]] double period_s() const noexcept { return period_s_; }
  // Enough steps were seen to tell frames of lag from time. RT-safe.
  [[nodiscard]] bool settled() const noexcept { return steps_ >= kSettled; }

 private:
  void learn(double step_s) noexcept;

  static constexpr int kRecent = 15;
  static constexpr int kSettled = 3;

  std::array<double, kRecent> recent_s_{};
  int steps_ = 0;  // learned so far; counts on
  double period_s_ = 0.0;
  double now_s_ = 0.0;
  double late_s_ = 0.0;  // how far an arrival lies behind the beat
  std::int64_t last_ns_ = kNoTime_ns;
  bool started_ = false;
  bool device_time_ = false;
};

}  // namespace posed::smooth
