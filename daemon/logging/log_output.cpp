#include "daemon/logging/log_output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/sink.h>
#include <spdlog/spdlog.h>

#include "daemon/logging/journal.hpp"
#include "daemon/logging/line_limiter.hpp"
#include "proto/text/clean.hpp"

namespace posed::logging {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kMaxWaiting = 1024;  // lines
constexpr std::chrono::milliseconds kLastLinesWithin{200};
constexpr std::chrono::milliseconds kForEver = std::chrono::milliseconds::max();

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(SteadyClock::now().time_since_epoch())
      .count();
}

// The colour of the level on a terminal; the same colours as spdlog's own sinks.
std::string_view colour_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::info:
      return "\033[32m";
    case spdlog::level::warn:
      return "\033[33m\033[1m";
    case spdlog::level::err:
      return "\033[31m\033[1m";
    case spdlog::level::critical:
      return "\033[1m\033[41m";
    default:
      return "";
  }
}

}  // namespace

// The sink, and everything that the thread uses. It outlives the LogOutput if the thread has to be
// left running.
class LogOutput::Queue final : public spdlog::sinks::sink {
 public:
  explicit Queue(int descriptor)
      : descriptor_(descriptor),
        coloured_(::isatty(descriptor) == 1),
        journal_(is_journal(descriptor)) {}

  void log(const spdlog::details::log_msg& message) override {
    // The text may contain names chosen by files, devices and clients; clean() removes control
    // characters, so that none of them can act on a terminal.
    const std::string text = clean({message.payload.data(), message.payload.size()});
    spdlog::details::log_msg shown = message;
    shown.payload = text;
    const std::scoped_lock lock(mutex_);
    if (!limits_ || limiter_.admit(now_ns(), message.level, text)) {
      push({.line = format(shown), .fields = fields_of({message.level, text})});
    }
    changed_.notify_all();  // a line waits, or one that was held back will be due
  }
  void flush() override {}
  void set_pattern(const std::string& /*pattern*/) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    const std::scoped_lock lock(mutex_);
    formatter_ = std::move(formatter);
  }

  void say(std::string_view line) {
    const std::scoped_lock lock(mutex_);
    push({.line = std::string(line) + '\n',
          .fields = fields_of({spdlog::level::info, std::string(line)})});
    changed_.notify_all();
  }

  void limit() {
    const std::scoped_lock lock(mutex_);
    limits_ = true;
  }

  // The thread's function.
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      sum_up();
      if (!lines_.empty()) {
        write_next(lock);
      } else if (ending_) {
        break;
      } else if (const std::int64_t due_ns = limiter_.next_due_ns(); due_ns == kNoTime_ns) {
        changed_.wait(lock);
      } else {
        changed_.wait_until(lock, SteadyClock::time_point(std::chrono::nanoseconds(due_ns)));
      }
    }
    ended_ = true;
    changed_.notify_all();
  }

  // Returns whether the thread has written everything and ended within `patience`.
  bool end(std::chrono::milliseconds patience) {
    {
      std::unique_lock lock(mutex_);
      ending_ = true;
      changed_.notify_all();
      changed_.wait_for(lock, patience, [this] { return ended_; });
    }
    // Locks again because the thread sanitizer does not see that the wait has locked the mutex.
    const std::scoped_lock lock(mutex_);
    return ended_;
  }

 private:
  struct Waiting {
    std::string line;
    std::vector<std::string> fields;  // where the journal gets it instead of the line
  };

  // All functions below: call with the lock held.
  void push(Waiting line) {
    if (lines_.size() >= kMaxWaiting) {
      lines_.pop_front();
      ++lost_;
    }
    lines_.push_back(std::move(line));
  }

  void sum_up() {
    while (const auto line = limiter_.next_summary(now_ns(), ending_)) {
      push({.line = format_text(static_cast<spdlog::level::level_enum>(line->level), line->text),
            .fields = fields_of(*line)});
    }
  }

  void write_next(std::unique_lock<std::mutex>& lock) {
    const std::uint64_t lost = std::exchange(lost_, 0);
    std::string text;
    if (lost > 0) {
      text = format_text(
          spdlog::level::warn,
          std::to_string(lost) + " lines of the log were discarded here: nobody read it");
    }
    const Waiting next = std::move(lines_.front());
    text += next.line;
    lines_.pop_front();
    lock.unlock();
    // What the journal does not take as fields it gets as a line.
    const bool written = (journal_ && lost == 0 && send_to_journal(next.fields)) ||
                         write_within(descriptor_, text, kForEver);
    lock.lock();
    if (!written) lost_ += lost + 1;
  }

  [[nodiscard]] std::vector<std::string> fields_of(const LineLimiter::Line& line) const {
    if (!journal_) return {};
    const std::string cause = line.cause.empty() ? cause_of(line.text) : line.cause;
    return journal_fields(line.level, line.text, cause, line.count);
  }

  std::string format_text(spdlog::level::level_enum level, const std::string& text) {
    return format(spdlog::details::log_msg("posed", level, text));
  }

  std::string format(const spdlog::details::log_msg& message) {
    spdlog::memory_buf_t buffer;
    formatter_->format(message, buffer);
    std::string line(buffer.data(), buffer.size());
    if (coloured_ && message.color_range_end > message.color_range_start) {
      line.insert(message.color_range_end, "\033[m");
      line.insert(message.color_range_start, colour_of(message.level));
    }
    return line;
  }

  const int descriptor_;
  const bool coloured_;
  const bool journal_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<spdlog::formatter> formatter_ = std::make_unique<spdlog::pattern_formatter>();
  LineLimiter limiter_;
  bool limits_ = false;
  std::deque<Waiting> lines_;
  std::uint64_t lost_ = 0;  // lines that were discarded and not reported yet
  bool ending_ = false, ended_ = false;
};

namespace {

std::shared_ptr<LogOutput::Queue> queue_in_use() {
  const auto logger = spdlog::default_logger();
  if (!logger || logger->sinks().empty()) return nullptr;
  return std::dynamic_pointer_cast<LogOutput::Queue>(logger->sinks().front());
}

}  // namespace

LogOutput::LogOutput(int descriptor) : queue_(std::make_shared<Queue>(descriptor)) {
  // Blocks all signals while the thread is started, because signals are for the thread that waits
  // for them, and this one is started before any signal is blocked.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread([queue = queue_] {
    pthread_setname_np(pthread_self(), "posed-log");
    queue->run();
  }).detach();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("posed", queue_));
}

LogOutput::~LogOutput() { queue_->end(kLastLinesWithin); }

void sum_up_repeats() {
  if (const auto queue = queue_in_use()) queue->limit();
}

void say(std::string_view line) {
  if (const auto queue = queue_in_use()) return queue->say(line);
  write_within(STDERR_FILENO, std::string(line) + '\n', kLastLinesWithin);
}

bool write_within(int descriptor, std::string_view text, std::chrono::milliseconds patience) {
  const bool for_ever = patience == kForEver;
  const auto deadline = SteadyClock::now() + (for_ever ? std::chrono::milliseconds(0) : patience);
  while (!text.empty()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - SteadyClock::now());
    pollfd wait{.fd = descriptor, .events = POLLOUT, .revents = 0};
    const int timeout_ms = for_ever ? -1 : static_cast<int>(std::max<long>(left.count(), 0));
    if (::poll(&wait, 1, timeout_ms) == 0) return false;
    // A pipe that is ready takes this much without blocking.
    const ssize_t wrote =
        ::write(descriptor, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
    if (wrote > 0) {
      text.remove_prefix(static_cast<std::size_t>(wrote));
    } else if (wrote < 0 && errno != EAGAIN && errno != EINTR) {
      return false;
    }
  }
  return true;
}

void protect_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The new descriptor gets the lowest free number, which is this one. It is opened in the wrong
    // direction, so that using it still fails.
    [[maybe_unused]] const int opened =
        ::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
  // A reader that has gone, and a file at its size limit, are then ordinary errors.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

}  // namespace posed::logging
