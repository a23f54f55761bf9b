// Work whose end nobody knows: after a second stderr says what is going on and for how long, once
// on a line of a terminal, now and then elsewhere. Ctrl-C ends the process as ever.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace posed::cli {

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
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace posed::cli
