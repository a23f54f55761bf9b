// LineLimiter writes at most one line a second for each cause, so that nobody who can make the
// daemon log something can fill its log. Two lines have the same cause if they have the same level
// and differ only in numbers. The first line is written at once. Lines that follow within a second
// are counted, and the last of them is written with the count. Many streams with one cause (bodies
// that come and go all the time) are counted together after their first lines, and said every eight
// seconds. Pure: no clock, no lock, no output.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "proto/frame/time.hpp"

namespace posed::logging {

// The text with its numbers taken out. Digits inside a word stay ("glove-2", "/dev/ttyUSB0"), and
// so does the first word before a colon, which names the stream.
[[nodiscard]] std::string cause_of(std::string_view text);

class LineLimiter {
 public:
  struct Line {
    int level = 0;
    std::string text;
    std::string cause{};      // cause_of() the lines that a summary replaces; empty otherwise
    std::uint64_t count = 1;  // how many lines a summary replaces
  };

  // Whether to write the line now. A line that is held back is counted, and next_summary() returns
  // it.
  [[nodiscard]] bool admit(std::int64_t now_ns, int level, std::string_view text);

  // The next summary of lines that were held back, if its second is over; with `at_end`, without
  // waiting. Call it until it returns nothing.
  [[nodiscard]] std::optional<Line> next_summary(std::int64_t now_ns, bool at_end = false);

  // When next_summary() next has something; kNoTime_ns if no line is held back.
  [[nodiscard]] std::int64_t next_due_ns() const;

 private:
  struct Cause {
    std::int64_t written_ns = 0;  // when a line of this cause was last written
    std::uint64_t held = 0;       // lines held back since then
    Line last;
  };
  // The same cause of all streams.
  struct Kind {
    double credit = kStreamsAtOnce;  // lines that may still be written; grows again slowly
    std::int64_t credit_ns = 0;
    Cause held{};
  };
  [[nodiscard]] bool may_begin_another(std::int64_t now_ns);
  // Takes a line from the credit of its kind, or holds back these lines.
  [[nodiscard]] bool admit_of_kind(std::int64_t now_ns, const Line& last, std::uint64_t count);

  std::map<std::string, Kind, std::less<>> kinds_;
  std::map<std::string, Cause, std::less<>> causes_;
  // lines held back because there were too many causes
  Cause others_{.written_ns = kNoTime_ns, .held = 0, .last = {}};
  // How many lines of new causes may still be written; grows again slowly.
  double credit_ = kMaxAtOnce;
  std::int64_t credit_ns_ = kNoTime_ns;

  static constexpr double kMaxAtOnce = 256.0;  // enough for the lines of 64 streams at their start
  static constexpr double kNewPerSecond = 8.0;
  static constexpr double kStreamsAtOnce = 64.0;
  static constexpr double kOfKindPerSecond = 0.125;
};

}  // namespace posed::logging
