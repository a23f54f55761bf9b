#include "daemon/tools/command/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace posed::tools {

using std::chrono::seconds;

Waiting::Waiting(std::string what)
    : what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) == 1),
      thread_([this](const std::stop_token& stop) { show(stop); }) {}

Waiting::~Waiting() {
  thread_.request_stop();
  thread_.join();
}

void Waiting::show(const std::stop_token& stop) {
  const auto never = [] { return false; };
  std::unique_lock lock(mutex_);
  seconds passed{0};
  bool drawn = false;
  while (true) {
    // In a log file a line a second is too much: print after 1, 2, 4, ... seconds.
    const seconds step = terminal_ ? seconds(1) : std::max(seconds(1), passed);
    ended_.wait_for(lock, stop, step, never);
    if (stop.stop_requested()) break;
    passed += step;
    std::fprintf(stderr, terminal_ ? "\r\033[K%s ... %lld s" : "%s ... %lld s\n", what_.c_str(),
                 static_cast<long long>(passed.count()));
    drawn = true;
  }
  if (terminal_ && drawn) std::fprintf(stderr, "\r\033[K");
}

namespace {

constexpr int kBarCells = 30;
constexpr double kLineEvery_s = 5.0;
constexpr double kEnoughForGuess = 0.02;  // before that the time left is a guess at noise

volatile std::sig_atomic_t g_interrupted = 0;

void interrupt(int /*signal*/) { g_interrupted = 1; }

std::string time_left(double fraction, double elapsed_s) {
  if (fraction < kEnoughForGuess || fraction >= 1.0) return {};
  const auto left_s = static_cast<long>(std::ceil(elapsed_s * (1.0 - fraction) / fraction));
  return left_s < 60
             ? "ETA " + std::to_string(left_s) + " s"
             : "ETA " + std::to_string(left_s / 60) + " min " + std::to_string(left_s % 60) + " s";
}

}  // namespace

ProgressBar::ProgressBar(double quiet_for_s)
    : start_(std::chrono::steady_clock::now()),
      quiet_for_s_(quiet_for_s),
      terminal_(isatty(STDERR_FILENO) == 1) {
  g_interrupted = 0;
  struct sigaction action{};
  action.sa_handler = interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // a second Ctrl-C ends the process at once
  sigaction(SIGINT, &action, &before_);
}

void ProgressBar::finish() {
  if (terminal_ && !last_step_.empty()) std::fprintf(stderr, "\r\033[K");
  last_step_.clear();
}

ProgressBar::~ProgressBar() {
  finish();
  sigaction(SIGINT, &before_, nullptr);
}

bool ProgressBar::show(std::string_view step, double fraction) {
  if (elapsed_s() < quiet_for_s_) return g_interrupted == 0;
  fraction = std::clamp(fraction, 0.0, 1.0);
  const int tenth = static_cast<int>(fraction * 10.0);
  if (terminal_) {
    draw(step, fraction);
  } else if (tenth != last_tenth_ || elapsed_s() - last_line_s_ >= kLineEvery_s) {
    last_tenth_ = tenth;
    last_line_s_ = elapsed_s();
    std::fprintf(stderr, "%3.0f %%  %.*s\n", 100.0 * fraction, static_cast<int>(step.size()),
                 step.data());
  }
  last_step_ = step;
  return g_interrupted == 0;
}

double ProgressBar::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void ProgressBar::draw(std::string_view step, double fraction) const {
  const auto full = static_cast<std::size_t>(std::lround(fraction * kBarCells));
  const std::string cells = std::string(full, '#') + std::string(kBarCells - full, '.');
  std::fprintf(stderr, "\r\033[K[%s] %3.0f %%  %.*s  %s", cells.c_str(), 100.0 * fraction,
               static_cast<int>(step.size()), step.data(),
               time_left(fraction, elapsed_s()).c_str());
  std::fflush(stderr);
}

}  // namespace posed::tools
