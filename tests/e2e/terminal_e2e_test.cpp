// What people see: the screens of `posed top` and `posed calibrate` on a real terminal, and their
// keys.
#include <pty.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include "tests/e2e/served.hpp"
#include "tests/support/has.hpp"
#include "tests/support/posing_glove.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kUpKey = "\x1b[A";
constexpr const char* kRightKey = "\x1b[C";
constexpr const char* kLeftInApplicationMode = "\x1bOD";

// `posed` behind a pseudo-terminal of that size.
class OnTerminal {
 public:
  OnTerminal(std::vector<std::string> arguments, unsigned short columns, unsigned short rows) {
    arguments.insert(arguments.begin(), posed_binary().string());
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const winsize size{.ws_row = rows, .ws_col = columns, .ws_xpixel = 0, .ws_ypixel = 0};
    pid_ = ::forkpty(&fd_, nullptr, nullptr, &size);
    if (pid_ == 0) {
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    REQUIRE(pid_ > 0);
  }
  ~OnTerminal() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    ::close(fd_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  void press(const char* key) const {
    REQUIRE(::write(fd_, key, std::char_traits<char>::length(key)) > 0);
  }

  // Whether a whole screen with these words is drawn; it is screen() then.
  bool comes_to_show(const std::string& words) {
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (std::chrono::steady_clock::now() < end && read_more()) {
      if (has(screen(), words)) return true;
    }
    return false;
  }

  // The last screen that was drawn to its end, without colours.
  [[nodiscard]] std::string screen() const {
    const auto last = text_.rfind(kRedraw);
    if (last == std::string::npos || last == 0) return {};
    const auto begin = text_.rfind(kRedraw, last - 1);
    std::string plain;
    for (std::size_t i = begin; i < last; ++i) {
      if (text_[i] == '\x1b') {
        i = text_.find_first_of("HJKm", i);
      } else {
        plain += text_[i];
      }
    }
    return plain;
  }

  // Reads until the program ends; its exit code.
  int end() {
    while (read_more()) {
    }
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static constexpr const char* kRedraw = "\x1b[H";

  bool read_more() {
    char buffer[65536];
    pollfd waits{fd_, POLLIN, 0};
    if (::poll(&waits, 1, 20'000) <= 0) return false;
    const ssize_t size = ::read(fd_, buffer, sizeof buffer);
    if (size > 0) text_.append(buffer, static_cast<std::size_t>(size));
    return size > 0;  // Linux: an error when the program has ended
  }

  int fd_ = -1;
  pid_t pid_ = -1;
  std::string text_;
};

int widest(const std::string& screen) {
  int most = 0, columns = 0;
  for (const char c : screen) {
    if (c == '\n') columns = 0;
    const bool starts_character = (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    if (starts_character && c != '\n' && c != '\r') most = std::max(most, ++columns);
  }
  return most;
}

}  // namespace

TEST_CASE("top draws the chosen stream on a terminal, and arrow keys choose it and its alpha",
          "[terminal]") {
  Served served;
  served.start();
  OnTerminal top({"top", "--connect", served.publish, "--control", served.control}, 60, 24);
  REQUIRE(top.comes_to_show("> walker "));
  REQUIRE(top.comes_to_show("left/right: alpha"));
  REQUIRE(top.comes_to_show("\xe2\xa0"));      // a pattern of braille
  REQUIRE(top.comes_to_show("\xe2\x96\x88"));  // the tallest bar of latency
  INFO(top.screen());
  CHECK(widest(top.screen()) <= 60);
  CHECK(has(top.screen(), "LATENCY"));

  top.press(kRightKey);
  CHECK(top.comes_to_show("style.alpha 1 -> 1.1 "));
  top.press(kLeftInApplicationMode);
  top.press(kLeftInApplicationMode);
  CHECK(top.comes_to_show(" -> 0.9 "));
  top.press("\x1b");  // the bytes of a key that a network delivers apart
  top.press("[");
  std::this_thread::sleep_for(300ms);
  top.press("C");
  CHECK(top.comes_to_show(" -> 1 "));
  top.press("x");     // does nothing
  top.press(kUpKey);  // there is only one stream
  top.press("q");
  CHECK(top.end() == 0);
  CHECK(top.text().ends_with("\x1b[?1049l"));  // the screen of before is back
}

TEST_CASE("top on a terminal keeps alpha within its limits, and says when the daemon is silent",
          "[terminal]") {
  Served served;
  served.start();
  OnTerminal top({"top", "--connect", served.publish, "--control", served.control}, 80, 24);
  REQUIRE(top.comes_to_show("> walker "));
  for (int i = 0; i < 15; ++i) top.press(kRightKey);
  REQUIRE(top.comes_to_show("-> 2 "));
  served.daemon->send(SIGSTOP);
  CHECK(top.comes_to_show("no answer for "));
  CHECK_FALSE(has(top.screen(), "LATENCY"));
  served.daemon->send(SIGCONT);
  CHECK(top.comes_to_show("LATENCY"));
}

TEST_CASE("top on a terminal says why alpha stays", "[terminal]") {
  Served served;
  served.start();
  OnTerminal watching({"top", "--connect", served.publish}, 80, 24);
  REQUIRE(watching.comes_to_show("> walker "));
  CHECK_FALSE(has(watching.screen(), "left/right"));
  watching.press(kRightKey);
  CHECK(watching.comes_to_show("add --control, "));
  OnTerminal lost({"top", "--connect", served.publish, "--control", "tcp://127.0.0.1:9"}, 80, 24);
  REQUIRE(lost.comes_to_show("> walker "));
  lost.press(kRightKey);
  CHECK(lost.comes_to_show("alpha stays: "));
  CHECK(lost.comes_to_show("tcp://127.0.0.1:9"));
}

TEST_CASE("calibrate on a terminal ends with a verdict and the calibrated hand", "[terminal]") {
  const TempFolder folder;
  PosingGlove glove;
  const std::string out = (folder.path() / "ann.toml").string();
  OnTerminal calibrate({"calibrate", "--driver", "cyberglove", "--port", glove.port(), "--user",
                        "ann", "--seconds", "0.5", "--ready", "1", "--out", out},
                       80, 24);
  for (std::size_t p = 0; p < drivers::glove::kPoses; ++p) {
    REQUIRE(calibrate.comes_to_show("[" + std::string(drivers::glove::kPoseNames[p]) + "]"));
    glove.hold(static_cast<drivers::glove::Pose>(p));
  }
  CHECK(calibrate.end() == 0);
  const std::string& text = calibrate.text();
  const std::string after = text.substr(text.rfind("\x1b[?1049l"));
  INFO(after);
  CHECK(has(after, "posed: good"));
  CHECK(has(after, "\xe2\xa1"));  // a pattern of braille
  CHECK(has(after, "    flat           fist           thumb         spread    "));
  CHECK(has(after, " touch-fist "));
  CHECK(has(after, "sensors calibrated: "));
}

}  // namespace posed::test
