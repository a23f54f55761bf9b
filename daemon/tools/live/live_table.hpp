// The table of streams of the live view: one row a stream, with its health by word and colour. A
// column that no stream has a value for is left out. Pure.
#pragma once

#include <string>
#include <vector>

namespace posed::v1 {
class Stats;
class StreamStats;
}  // namespace posed::v1

namespace posed::tools {

struct LiveTableOptions {
  int width = 80;        // of a row [columns]; 0: names are not cut, rows are not padded
  int rows = 0;          // most rows with the heading; 0: no limit
  bool colour = false;   // ANSI colours
  bool silent = false;   // the stats are old: what describes the present is not shown
  std::string chosen{};  // the stream whose row is marked, and visible; may be empty
};

// The heading, then the rows. Streams that do not fit are counted in the last row.
[[nodiscard]] std::vector<std::string> live_table(const v1::Stats& stats,
                                                  const LiveTableOptions& options);

// Whether a stage of the stream has an alpha.
[[nodiscard]] bool has_alpha(const v1::StreamStats& stream);

// Whether frames of the stream were dropped or skipped so far.
[[nodiscard]] bool has_lost(const v1::StreamStats& stream);

// A duration as people read it: "0.2 ms", "12.5 ms", "2.5 s"; at most 8 characters.
[[nodiscard]] std::string people_duration(double microseconds);

}  // namespace posed::tools
