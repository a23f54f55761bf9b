// Heartbeat: whether a daemon that says something every second still does. Time is handed in, so a
// test can let it pass.
#pragma once

#include <cstdint>
#include <optional>

namespace posed::cli {

class Heartbeat {
 public:
  explicit Heartbeat(std::int64_t now_ns) : last_ns_(now_ns) {}

  void heard(std::int64_t now_ns);
  // For how long nothing was heard [s], once that is too long to be chance; nothing while it
  // answers. Before the first message the patience is shorter: a user waits.
  [[nodiscard]] std::optional<double> silent_s(std::int64_t now_ns) const;
  [[nodiscard]] bool ever_heard() const { return ever_heard_; }

  // For those who print lines: the silence, each time that a line about it is due (at once, then
  // after twice, four times, ... as long).
  [[nodiscard]] std::optional<double> silence_to_report(std::int64_t now_ns);
  // How long it was silent [s], once after a silence that was told.
  [[nodiscard]] std::optional<double> return_to_report();

 private:
  std::int64_t last_ns_;
  bool ever_heard_ = false;
  double reported_s_ = 0.0;         // the silence that was told last; 0: none
  std::optional<double> returned_;  // not told yet
};

}  // namespace posed::cli
