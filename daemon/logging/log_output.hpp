// LogOutput writes the log. Lines go into a bounded queue, and a separate thread writes them to
// stderr. So a thread that logs never waits for the reader of stderr: if nobody reads the pipe, the
// oldest lines are discarded and counted. Cold; any thread may log.
#pragma once

#include <chrono>
#include <memory>
#include <string_view>

#include <unistd.h>

namespace posed::logging {

class LogOutput {
 public:
  // Starts the thread, with all signals blocked, and becomes spdlog's default logger. `descriptor`
  // must stay open while this object exists.
  explicit LogOutput(int descriptor = STDERR_FILENO);
  // Writes the lines that wait, for at most 0.2 s. If the thread still cannot write then, it is
  // left running.
  ~LogOutput();
  LogOutput(const LogOutput&) = delete;
  LogOutput& operator=(const LogOutput&) = delete;

  class Queue;

 private:
  std::shared_ptr<Queue> queue_;
};

// Limits the log from now on to one line a second for each cause (line_limiter.hpp), for commands
// in which untrusted clients can cause lines. Has no effect without a LogOutput.
void sum_up_repeats();

// Adds a whole line, without a time, after what was logged before; without a LogOutput it goes
// straight to stderr. The limiter never holds it back.
void say(std::string_view line);

// Writes all of `text`; returns false if the descriptor is broken or did not accept it in time.
// Waits with poll, so it also works for a descriptor that another program has set non-blocking. The
// largest `patience` waits for ever.
bool write_within(int descriptor, std::string_view text, std::chrono::milliseconds patience);

// Call at the beginning of main(). The number of a closed standard descriptor would be given to the
// next file that is opened, and messages would be written into that file; so each closed one is
// opened on /dev/null in the direction in which its use still fails. Also ignores SIGPIPE and
// SIGXFSZ: to write to a reader that has gone, or beyond a file's size limit, is then an error and
// does not end the process.
void protect_standard_descriptors();

}  // namespace posed::logging
