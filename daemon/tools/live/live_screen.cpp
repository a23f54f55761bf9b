#include <cstdio>
#include <cstdlib>
#include <utility>

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "daemon/tools/live/live_view.hpp"

namespace posed::tools {
namespace {

termios keyboard_before;  // global, because a process has one terminal

void put_on_screen(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

Key other_key(char byte) { return byte == 'q' || byte == 'Q' ? Key::kQuit : Key::kOther; }

Key arrow(char last_byte) {
  switch (last_byte) {
    case 'A':
      return Key::kUp;
    case 'B':
      return Key::kDown;
    case 'C':
      return Key::kRight;
    case 'D':
      return Key::kLeft;
    default:
      return Key::kOther;
  }
}

}  // namespace

LiveScreen::LiveScreen()
    : terminal_(isatty(STDOUT_FILENO) == 1), keyboard_(terminal_ && isatty(STDIN_FILENO) == 1) {
  if (keyboard_ && tcgetattr(STDIN_FILENO, &keyboard_before) == 0) {
    termios raw = keyboard_before;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C still sends a signal
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  } else {
    keyboard_ = false;
  }
  if (terminal_) put_on_screen("\x1b[?1049h\x1b[?25l\x1b[2J");  // alternate screen, no cursor
}

LiveScreen::~LiveScreen() {
  if (terminal_) put_on_screen("\x1b[?25h\x1b[?1049l");
  if (keyboard_) tcsetattr(STDIN_FILENO, TCSANOW, &keyboard_before);
}

void LiveScreen::measure(LiveViewOptions& options) const {
  options.colour = terminal_ && std::getenv("NO_COLOR") == nullptr;
  if (!terminal_) {
    options.width = 0;
    options.height = 0;
    return;
  }
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return;
  options.width = size.ws_col;
  options.height = size.ws_row;
}

void LiveScreen::draw(const std::vector<std::string>& lines) const {
  std::string text = terminal_ ? "\x1b[H" : "";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (terminal_) {
      text += lines[i] + "\x1b[K" + (i + 1 < lines.size() ? "\r\n" : "");
    } else {
      text += lines[i] + "\n";
    }
  }
  if (terminal_) text += "\x1b[J";
  put_on_screen(text);
}

char LiveScreen::key_pressed() const {
  char key = 0;
  pollfd waits{STDIN_FILENO, POLLIN, 0};
  if (!keyboard_ || poll(&waits, 1, 0) <= 0 || ::read(STDIN_FILENO, &key, 1) != 1) return 0;
  return key;
}

// An arrow is ESC [ A to D, or ESC O A to D where the terminal is in application mode. A network
// may deliver its bytes apart, so the first of them are kept until the others come.
Key LiveScreen::next_key() {
  while (const char byte = key_pressed()) {
    const std::size_t before = std::exchange(arrow_bytes_, 0);
    if (byte == '\x1b') {
      arrow_bytes_ = 1;
    } else if (before == 1 && (byte == '[' || byte == 'O')) {
      arrow_bytes_ = 2;
    } else {
      return before == 2 ? arrow(byte) : other_key(byte);
    }
  }
  return Key::kNone;
}

}  // namespace posed::tools
