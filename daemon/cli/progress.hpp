// Progress of long work on stderr: a bar with the time left on a terminal, plain lines elsewhere.
// While one is alive, the first Ctrl-C asks the work to stop instead of ending the process.
#pragma once

#include <chrono>
#include <csignal>
#include <string>
#include <string_view>

namespace posed::cli {

class ProgressBar {
 public:
  ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar();

  // How far the whole work is, 0..1, and what is being done. False once Ctrl-C was pressed.
  bool show(std::string_view step, double fraction);

  [[nodiscard]] double elapsed_s() const;

 private:
  void draw(std::string_view step, double fraction) const;

  std::chrono::steady_clock::time_point start_;
  bool terminal_;
  std::string last_step_;
  int last_quarter_ = -1;
  struct sigaction before_{};
};

}  // namespace posed::cli
