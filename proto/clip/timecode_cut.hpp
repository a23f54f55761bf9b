// Cuts a clip by the timecode of a stage's generator (SMPTE 12M), as editors name its moments.
// Cold.
#pragma once

#include <optional>
#include <string_view>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// How a generator counts frames: 29.97 and its like count as 30 a second; with drop frame they
// leave out the first numbers of a minute, except of each tenth, so that they follow the clock.
struct TimecodeRate {
  int counted = 0;     // frames numbered in a second: 24, 25, 30, 48, 50, 60, 100, 120
  double per_s = 0.0;  // frames in a second of the clock
  bool drops = false;
};

// A moment that a user names: "hh:mm:ss:ff", "hh:mm:ss;ff" (drop frame) or "hh:mm:ss.mmm"; behind
// frames may stand their rate, "10:20:30:05@25", which a recording that does not count them needs.
struct TimecodeMoment {
  int second = 0;  // of the day, by its numbers
  int part = 0;    // frames, or milliseconds
  bool milliseconds = false;
  bool drops = false;
  std::optional<TimecodeRate> rate{};
};

// The error is a sentence for users.
Result<TimecodeMoment> parse_timecode(std::string_view text);

// The frames from the first at or after `from` to the last at or before `to`; either may be empty.
// A day may end between them. A clip that knows its timecode at some frames only, as that of a take
// with a trigger's, is counted on from there by its own time.
Result<Clip> cut_by_timecode(Clip clip, std::string_view from, std::string_view to);

}  // namespace posed::clip
