// The log's limiter on a test clock, and its output to pipes that are full, closed, and read again.
#include <algorithm>
#include <csignal>
#include <string>
#include <thread>

#include <spdlog/spdlog.h>
#include <catch2/catch.hpp>

#include "daemon/logging/line_limiter.hpp"
#include "daemon/logging/log_output.hpp"
#include "tests/support/ms.hpp"
#include "tests/support/pipe.hpp"

namespace posed::logging {
namespace {

using test::kMs;

// spdlog's default logger is global; restores that of other tests.
class RestoreDefaultLogger {
 public:
  ~RestoreDefaultLogger() { spdlog::set_default_logger(before_); }

 private:
  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

// Reads until `part` has come out of the pipe; returns everything that came.
std::string read_until(const test::Pipe& pipe, const std::string& part) {
  std::string all;
  while (all.find(part) == std::string::npos) {
    all += pipe.take();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return all;
}

}  // namespace

TEST_CASE("two lines have the same cause when they differ only in numbers") {
  CHECK(cause_of("walker: control takes effect at frame 17") ==
        cause_of("walker: control takes effect at frame 18"));
  CHECK(cause_of("a: alpha 1.00 -> -0.50") == cause_of("a: alpha -0.25 -> 0.75"));
  CHECK(cause_of("a: nothing came for 0.25 s") == cause_of("a: nothing came for 12.5 s"));
  CHECK(cause_of("glove-1: data comes again") != cause_of("glove-2: data comes again"));
  CHECK(cause_of("1: data comes again") != cause_of("2: data comes again"));
  CHECK(cause_of("/dev/ttyUSB0 is in use") != cause_of("/dev/ttyUSB1 is in use"));
  CHECK(cause_of("refused 10.0.0.5") == cause_of("refused 10.0.0.17"));
  CHECK(cause_of("") == "");
}

TEST_CASE(
    "the first line of a cause is written at once, the others once a second with their count") {
  LineLimiter limiter;
  CHECK(limiter.admit(0, 2, "a: frame 1"));
  CHECK(limiter.next_due_ns() == kNoTime_ns);
  for (int i = 2; i <= 1000; ++i) {
    CHECK_FALSE(limiter.admit(i * kMs / 2, 2, "a: frame " + std::to_string(i)));
  }
  CHECK(limiter.admit(600 * kMs, 2, "b: frame 1"));  // another stream
  CHECK(limiter.admit(600 * kMs, 4, "a: frame 1"));  // another level
  CHECK_FALSE(limiter.next_summary(999 * kMs));
  CHECK(limiter.next_due_ns() == 1000 * kMs);
  const auto line = limiter.next_summary(1000 * kMs);
  REQUIRE(line);
  CHECK(line->text == "a: frame 1000 (the last of 999 like it)");
  CHECK(line->level == 2);
  CHECK_FALSE(limiter.next_summary(1000 * kMs));
  CHECK_FALSE(limiter.admit(1500 * kMs, 2, "a: frame 1001"));
  CHECK(limiter.next_summary(1600 * kMs, true)->text == "a: frame 1001");  // at the end at once
  CHECK(limiter.admit(5000 * kMs, 2, "a: frame 1002"));                    // quiet for a while
}

TEST_CASE("many streams that come and go all the time give two lines in eight seconds together") {
  LineLimiter limiter;
  int written = 0;
  std::uint64_t told = 0;
  const auto count = [&](std::uint64_t lines) {
    ++written;
    told += lines;
  };
  constexpr int kSeconds = 60, kStreams = 60;
  std::int64_t now_ns = 0;
  for (int i = 0; i < kSeconds * kStreams; ++i) {
    now_ns += 1000 * kMs / kStreams;
    const std::string text = "room-" + std::string(1, static_cast<char>('A' + i % kStreams));
    if (limiter.admit(now_ns, 2, text + ": the body has left")) count(1);
    while (const auto line = limiter.next_summary(now_ns)) count(line->count);
  }
  while (const auto line = limiter.next_summary(now_ns, true)) count(line->count);
  CHECK(written < 64 + 2 * kSeconds / 8 + 3);
  CHECK(told == kSeconds * kStreams);
  // After a quiet time each stream has its own lines again.
  now_ns += 3600 * kNanosPerSecond;
  for (int i = 0; i < kStreams; ++i) {
    const std::string text = "room-" + std::string(1, static_cast<char>('A' + i));
    CHECK(limiter.admit(now_ns, 2, text + ": the body has left"));
  }
}

TEST_CASE("lines of ever new causes are limited to a few a second, too") {
  LineLimiter limiter;
  int written = 0;
  std::uint64_t reported = 0;
  for (int i = 0; i < 10'000; ++i) {
    std::string word;
    for (int left = i; left >= 0; left = left / 26 - 1) word += static_cast<char>('a' + left % 26);
    const std::int64_t now_ns = i * kMs;
    written += limiter.admit(now_ns, 2, "no stream " + word) ? 1 : 0;
    while (const auto line = limiter.next_summary(now_ns)) {
      CHECK(line->text.ends_with(" more lines of many kinds are left out"));
      reported += std::stoull(line->text);
    }
  }
  while (const auto line = limiter.next_summary(10'000 * kMs, true))
    reported += std::stoull(line->text);
  CHECK(written <= 256 + 8 * 10);
  CHECK(static_cast<std::uint64_t>(written) + reported == 10'000);  // every line is counted
}

TEST_CASE("logging never waits for a full pipe, and lost lines are counted in the log") {
  const RestoreDefaultLogger kept;
  test::Pipe pipe;
  pipe.fill();
  const LogOutput output(pipe.write_end());
  for (int i = 0; i < 5000; ++i) spdlog::info("line {}", i);
  say("posed: the end");
  const std::string log = read_until(pipe, "posed: the end\n");
  CHECK(log.find(" lines of the log were discarded here: nobody read it\n") != std::string::npos);
  CHECK(log.find("line 4999\n") != std::string::npos);  // the newest lines are kept
  CHECK(log.find("line 3000\n") == std::string::npos);
}

TEST_CASE("the log output ends even if nobody reads it") {
  const RestoreDefaultLogger kept;
  // Its writing end is never closed, because the thread that is left running may outlive the test.
  static test::Pipe& pipe = *new test::Pipe;
  pipe.fill();
  {
    const LogOutput output(pipe.write_end());
    spdlog::warn("for nobody");
  }
  std::signal(SIGPIPE, SIG_IGN);
  pipe.close_reader();  // ends the thread that was left running
  spdlog::warn("after the end");
}

TEST_CASE("a pipe without a reader discards lines, and later lines are not lost") {
  const RestoreDefaultLogger kept;
  std::signal(SIGPIPE, SIG_IGN);
  test::Pipe pipe;
  pipe.close_reader();
  {
    const LogOutput output(pipe.write_end());
    for (int i = 0; i < 100; ++i) spdlog::info("line {}", i);
  }
  CHECK_FALSE(write_within(pipe.write_end(), "x", std::chrono::milliseconds(0)));
}

TEST_CASE("repeated lines are summed up when a command asks for it") {
  const RestoreDefaultLogger kept;
  test::Pipe pipe;
  {
    const LogOutput output(pipe.write_end());
    sum_up_repeats();
    for (int i = 0; i < 5000; ++i) spdlog::info("line {}", i);
    say("posed: first");
    say("posed: first");
  }
  const std::string log = pipe.take();
  CHECK(std::ranges::count(log, '\n') <= 10);
  CHECK(log.find("line 0\n") != std::string::npos);
  CHECK(log.find(" like it)\n") != std::string::npos);
  CHECK(log.find("posed: first\nposed: first\n") != std::string::npos);
}

TEST_CASE("names in a line can neither control the terminal nor fill it") {
  const RestoreDefaultLogger kept;
  test::Pipe pipe;
  {
    const LogOutput output(pipe.write_end());
    spdlog::warn("stream {} is away", "\x1b[2J\nforged: all is well");
    spdlog::warn("joint {}", std::string(1 << 20, 'x'));
  }
  const std::string log = pipe.take();
  CHECK(log.find("stream \\x1b[2J\\nforged: all is well is away\n") != std::string::npos);
  CHECK(log.find('\x1b') == std::string::npos);
  CHECK(std::ranges::count(log, '\n') == 2);
  CHECK(log.size() < 5000);
}

TEST_CASE("a reader that has gone and a file at its size limit end no process") {
  for (const int signal : {SIGPIPE, SIGXFSZ}) {
    auto* const before = std::signal(signal, SIG_DFL);
    protect_standard_descriptors();
    CHECK(std::signal(signal, before) == SIG_IGN);
  }
}

}  // namespace posed::logging
