// LogOutput: where the log goes. Lines are put into a bounded queue, and a thread of its own writes
// them to stderr, so that whoever logs never waits for whoever reads: a pipe that nobody empties
// costs old lines, which are counted, and nothing else. Cold; any thread may log.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <unistd.h>

namespace posed::logging {

class LogOutput {
 public:
  // Starts the thread, with all signals blocked, and becomes spdlog's default logger. `descriptor`
  // stays open as long as it writes there.
  explicit LogOutput(int descriptor = STDERR_FILENO);
  // Writes what waits, for at most 0.2 s; a thread that still cannot write then is left to itself.
  ~LogOutput();
  LogOutput(const LogOutput&) = delete;
  LogOutput& operator=(const LogOutput&) = delete;

  class Queue;

 private:
  std::shared_ptr<Queue> queue_;
};

// From now on at most one line a second of each cause (line_limiter.hpp): for commands that
// strangers can make say something. Nothing without a LogOutput.
void sum_up_repeats();

// Puts a whole line, without a time, behind what was logged before; without a LogOutput it goes
// straight to stderr. Never sum up nor left out by the limiter.
void say(std::string_view line);

// Writes all of `text`; false when the descriptor is broken or did not take it in time. Waits by
// poll, so a descriptor that others have set non-blocking is served, too.
bool write_within(int descriptor, std::string_view text, std::chrono::milliseconds patience);

// For the beginning of main(). A closed standard descriptor would be given to the next file that is
// opened, and lines for people would go into it: each one that is closed is opened so that its use
// still fails. SIGPIPE is ignored, so that a reader that goes is an error of the write and does not
// end the process.
void protect_standard_descriptors();

}  // namespace posed::logging
