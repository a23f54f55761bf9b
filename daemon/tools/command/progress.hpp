// Progress of long work on stderr: a bar with the time left on a terminal, plain lines elsewhere,
// one each 10 % or 5 s.
// While one is alive, the first Ctrl-C asks the work to stop instead of ending the process.
#pragma once

#include <chrono>
#include <csignal>
#include <string>
#include <string_view>

namespace posed::tools {

inline constexpr double kQuietFor_s = 1.0;  // a longer wait needs a sign of progress

class ProgressBar {
 public:
  // Draws nothing until the work has taken `quiet_for_s`, because short work needs no bar.
  explicit ProgressBar(double quiet_for_s = 0.0);
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar();

  // Shows the progress of the whole work, 0..1, and the current step. Returns false after Ctrl-C.
  bool show(std::string_view step, double fraction);

  // Removes the bar from the terminal; call before anything else is printed.
  void finish();

  [[nodiscard]] double elapsed_s() const;

 private:
  void draw(std::string_view step, double fraction) const;

  std::chrono::steady_clock::time_point start_;
  double quiet_for_s_;
  bool terminal_;
  std::string last_step_;
  int last_tenth_ = -1;       // of the last line off a terminal
  double last_line_s_ = 0.0;  // when it was printed
  struct sigaction before_{};
};

}  // namespace posed::tools
