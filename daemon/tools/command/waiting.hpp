// Shows work of unknown duration: after a second stderr says what is being done and for how long;
// on a terminal in one line that is rewritten, elsewhere a line from time to time. Ctrl-C ends the
// process as usual.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace posed::tools {

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

}  // namespace posed::tools
