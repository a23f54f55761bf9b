// The live view of a daemon: its stats as lines of text, and the terminal on which they are
// redrawn. Used by `top` and `demo`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace posed::v1 {
class Stats;
}

namespace posed::tools {

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
