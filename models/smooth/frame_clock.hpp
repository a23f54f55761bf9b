// FrameClock: computes times that a solver can use from the times that frames carry
// (models/smooth/README.md, "Frame clock"). Device times are used as they are; arrival times of an
// even stream come in bursts and are drawn towards the stream's own period. Steps are never shorter
// than half the period, so that two frames which arrive together do not look infinitely fast, and a
// time that runs backwards counts as one period. One thread.
#pragma once

#include <array>
#include <cstdint>

#include "proto/frame/frame.hpp"

namespace posed::smooth {

class FrameClock {
 public:
  // Seconds since the first frame; strictly increasing. RT-safe.
  double tick(const Header& header) noexcept;

  // The stream's period: the median of the last steps [s]; 0 before the first step. RT-safe.
  [[nodiscard]] double period_s() const noexcept { return period_s_; }
  // True when enough steps are known to convert a lag in time into frames. RT-safe.
  [[nodiscard]] bool settled() const noexcept { return steps_ >= kSettled; }

 private:
  void learn(double step_s) noexcept;

  static constexpr int kRecent = 15;
  static constexpr int kSettled = 3;

  std::array<double, kRecent> recent_s_{};
  int steps_ = 0;  // number of steps learned so far
  double period_s_ = 0.0;
  double now_s_ = 0.0;
  double late_s_ = 0.0;  // accumulated lateness of arrivals relative to even frames
  std::int64_t last_ns_ = kNoTime_ns;
  bool started_ = false;
  bool device_time_ = false;
};

}  // namespace posed::smooth
