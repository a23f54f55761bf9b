// LineLimiter: at most one line a second of each cause, so that nobody who can make the daemon say
// something can fill its log. Two lines have the same cause when they have the same level and
// differ only in numbers. The first is written at once; what follows within a second is counted,
// and the last of it is written with the count. Pure: no clock, no lock, no output.
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
  };

  // Whether to write the line now. One that is held back comes out of take_due(), counted.
  [[nodiscard]] bool admit(std::int64_t now_ns, int level, std::string_view text);

  // A line that tells what was held back, once its second is over; at the end at once. Call it
  // until it has no more.
  [[nodiscard]] std::optional<Line> take_due(std::int64_t now_ns, bool at_end = false);

  // When take_due() has something next; kNoTime_ns when nothing is held back.
  [[nodiscard]] std::int64_t next_due_ns() const;

 private:
  struct Cause {
    std::int64_t written_ns = 0;  // when a line of it was last written
    std::uint64_t held = 0;       // lines since then
    Line last;
  };
  [[nodiscard]] bool may_begin_another(std::int64_t now_ns);

  std::map<std::string, Cause, std::less<>> causes_;
  Cause others_{.written_ns = kNoTime_ns, .held = 0, .last = {}};  // lines of too many causes
  // Lines of new causes that may still be written; it fills up again slowly.
  double credit_ = kMaxAtOnce;
  std::int64_t credit_ns_ = kNoTime_ns;

  static constexpr double kMaxAtOnce = 256.0;  // what 64 streams say when they start
  static constexpr double kNewPerSecond = 8.0;
};

}  // namespace posed::logging
