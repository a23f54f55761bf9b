// The live view of a daemon: its stats as lines of text, and the terminal they are drawn on in
// place. `top` and `demo` show the same.
#pragma once

#include <string>
#include <vector>

namespace posed::v1 {
class Stats;
}

namespace posed::cli {

struct LiveViewOptions {
  std::string title{};  // first words of the first line
  int width = 80;       // columns; at least 80 are used. 0: as many as the words need, none cut
  int height = 24;      // lines at most; 0: no limit
  bool colour = false;
  // Why nothing is known of the present, as one sentence; empty while the daemon answers. Then the
  // stats are old, and what of them describes the present is not shown.
  std::string silence{};
  std::vector<std::string> notes{};  // recent events, newest last; shown while there is room
};

// One line for the daemon, one for the columns' names, one a stream (rates, drops, sheds, p50/p99
// of each stage, alpha, model), then what is to be told of single streams: a glove that is away,
// came back or has a clock of its own; a hand's label and lag. Last the notes.
[[nodiscard]] std::vector<std::string> live_view(const v1::Stats& stats,
                                                 const LiveViewOptions& options);

// What the columns mean, for --help.
extern const char* const kColumnsHelp;

// Duration in at most 4 characters: "31", "850", "1.2m" (milliseconds), "2.5s".
[[nodiscard]] std::string short_duration(double microseconds);

// The terminal behind stdout. Draws in place while it lives and leaves the terminal as it was. When
// stdout is no terminal it just prints the lines.
class LiveScreen {
 public:
  LiveScreen();
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  [[nodiscard]] bool is_terminal() const { return terminal_; }
  // Fills width, height and colour from the terminal as it is now.
  void measure(LiveViewOptions& options) const;
  void draw(const std::vector<std::string>& lines) const;
  [[nodiscard]] char key_pressed() const;   // the next one on the keyboard; 0: none. Never waits
  [[nodiscard]] bool quit_pressed() const;  // 'q' was; takes all keys

 private:
  bool terminal_ = false;
  bool keyboard_ = false;  // stdin is a terminal too
};

}  // namespace posed::cli
