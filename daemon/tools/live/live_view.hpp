// The live view of a daemon: its stats as a table and lines of text, and the terminal on which they
// are redrawn. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace posed::v1 {
class Stats;
class StreamStats;
}  // namespace posed::v1

namespace posed::tools {

// The table of streams of the live view: one row a stream, with its health by word and colour. A
// column that no stream has a value for is left out. Pure.
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

// A duration as people read it: "0.2 ms", "2.5 s", "12 s", "5 min", "2.5 h"; at most 8 characters.
[[nodiscard]] std::string display_duration(double time_s);

// The live view of a daemon: its stats as lines of text, and the terminal on which they are
// redrawn. Used by `top` and `demo`.
struct LiveViewOptions {
  std::string title{};  // start of the first line
  int width = 80;       // columns; at least 20 are used. 0: as wide as the text needs
  int height = 24;      // maximal number of lines; 0: no limit
  bool colour = false;
  // Why there is no current data, as one sentence; empty while the daemon answers. If set, the
  // stats are old, and those of them that describe the present are not shown.
  std::string silence{};
  // The stream whose row is marked, and whose details are shown; of the others only what is wrong.
  // Empty: the details of all.
  std::string chosen{};
  // Makes lines that belong below the streams, for so many rows that are left; may be null.
  std::function<std::vector<std::string>(int rows)> panel{};
  std::vector<std::string> notes{};  // recent events, newest last; shown if there is space
};

// One line for the daemon, the table of streams (live_table.hpp), then details of single streams: a
// glove that is unplugged, came back or has its own clock; what was lost; the time of each stage;
// a hand's label and lag. The notes come last.
[[nodiscard]] std::vector<std::string> live_view(const v1::Stats& stats,
                                                 const LiveViewOptions& options);

// Explains the columns, for --help.
extern const char* const kColumnsHelp;

// A key that a screen knows; kOther: any other.
enum class Key : std::uint8_t { kNone, kUp, kDown, kLeft, kRight, kQuit, kOther };

// The terminal behind stdout. Redraws in place while it exists, and restores the terminal at the
// end. If stdout is not a terminal it prints plain lines.
class LiveScreen {
 public:
  LiveScreen();
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  [[nodiscard]] bool is_terminal() const { return terminal_; }
  // Sets width, height and colour to those of the terminal now.
  void measure(LiveViewOptions& options) const;
  void draw(const std::vector<std::string>& lines) const;
  [[nodiscard]] char key_pressed() const;  // the next byte of a key; 0: none. Never waits
  [[nodiscard]] Key next_key();            // kNone: no whole key is waiting. Never waits

 private:
  bool terminal_ = false;
  bool keyboard_ = false;        // stdin is a terminal, too
  std::size_t arrow_bytes_ = 0;  // that came of an arrow's three
};

}  // namespace posed::tools
