// Signs of progress on stderr: Waiting for work of unknown duration, ProgressBar for work that
// knows how much of it is done. Cold.
#pragma once

#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace posed::tools {

// Shows work of unknown duration: after a second stderr says what is being done and for how long;
// on a terminal in one line that is rewritten, elsewhere a line from time to time. Ctrl-C ends the
// process as usual.
class Waiting {
 public:
  // `what` as in "reading take.plog".
  explicit Waiting(std::string what);
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  ~Waiting();

 private:
  void show(const std::stop_token& stop);

  std::string what_;
  bool terminal_;
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;  // last, because it uses all of the above
};

inline constexpr double kQuietFor_s = 1.0;  // a longer wait needs a sign of progress

// Progress of long work on stderr: a bar with the time left on a terminal, plain lines elsewhere,
// one each 10 % or 5 s.
// While one is alive, the first Ctrl-C asks the work to stop instead of ending the process.
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
