// Heartbeat: whether a daemon that sends stats every second still does. The time is a parameter, so
// a test can choose it.
#pragma once

#include <cstdint>
#include <optional>

namespace posed::tools {

class Heartbeat {
 public:
  explicit Heartbeat(std::int64_t now_ns) : last_ns_(now_ns) {}

  void heard(std::int64_t now_ns);
  // How long the daemon has been silent [s], if that is longer than normal; empty while it answers.
  // Before the first message a shorter silence counts, because a user is waiting.
  [[nodiscard]] std::optional<double> silent_s(std::int64_t now_ns) const;
  [[nodiscard]] bool ever_heard() const { return ever_heard_; }

  // For output as lines: the silence, whenever a line about it is due (at once, then after twice,
  // four times, ... the time).
  [[nodiscard]] std::optional<double> silence_to_report(std::int64_t now_ns);
  // How long the daemon was silent [s], returned once after a silence that was reported.
  [[nodiscard]] std::optional<double> return_to_report();

 private:
  std::int64_t last_ns_;
  bool ever_heard_ = false;
  double reported_s_ = 0.0;         // the last silence that was reported; 0: none
  std::optional<double> returned_;  // not reported yet
};

}  // namespace posed::tools
