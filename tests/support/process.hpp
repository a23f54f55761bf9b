// Runs the real binary, or another program, as a child process and gives its output lines and exit
// code; the destructor ends the child.
#pragma once

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

// Where a child's stderr goes: a file that errors() reads, a descriptor of the test, or nowhere.
struct ChildStderr {
  static constexpr int kFile = -1, kClosed = -2;
  int descriptor = kFile;
};

// A program, found on the PATH, with its arguments.
struct Command {
  explicit Command(std::vector<std::string> all) : words(std::move(all)) {}
  std::vector<std::string> words;
};

class Process {
 public:
  // Starts `posed` with these arguments; stdin is empty. `stdout_descriptor` replaces the pipe that
  // line() reads. The child may open `most_files` files (0: the limit of this process).
  explicit Process(std::vector<std::string> arguments, ChildStderr err = {},
                   int stdout_descriptor = -1, int most_files = 0)
      : Process(of_posed(std::move(arguments), most_files), err, stdout_descriptor) {}
  // Starts any program.
  explicit Process(Command command, ChildStderr err = {}, int stdout_descriptor = -1) {
    std::vector<char*> argv;
    for (std::string& word : command.words) argv.push_back(word.data());
    argv.push_back(nullptr);
    int out[2];
    if (pipe2(out, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    const std::string log = (folder_.path() / "stderr").string();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, stdout_descriptor < 0 ? out[1] : stdout_descriptor,
                                     1);
    if (err.descriptor == ChildStderr::kFile) {
      posix_spawn_file_actions_addopen(&actions, 2, log.c_str(), O_WRONLY | O_CREAT, 0600);
    } else if (err.descriptor == ChildStderr::kClosed) {
      posix_spawn_file_actions_addclose(&actions, 2);
    } else {
      posix_spawn_file_actions_adddup2(&actions, err.descriptor, 2);
    }
    const int failed = posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(out[1]);
    out_ = out[0];
    if (failed != 0) throw std::runtime_error("cannot start " + command.words[0]);
  }
  ~Process() {
    if (!exit_code_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    hang_up();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // The next line of stdout; nullopt at its end or when none comes in time.
  std::optional<std::string> line(std::chrono::milliseconds within = kPatience) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (true) {
      if (const auto at = text_.find('\n'); at != std::string::npos) {
        std::string line = text_.substr(0, at);
        text_.erase(0, at + 1);
        return line;
      }
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      pollfd wait{out_, POLLIN, 0};
      if (left.count() <= 0 || poll(&wait, 1, static_cast<int>(left.count())) <= 0) return {};
      char buffer[65536];
      const ssize_t size = read(out_, buffer, sizeof buffer);
      if (size <= 0) return {};
      text_.append(buffer, static_cast<std::size_t>(size));
    }
  }
  // Reads stdout to its end.
  std::string rest() {
    std::string all;
    while (const auto next = line()) all += *next + "\n";
    return all;
  }

  // Closes the reading end of its stdout.
  void hang_up() {
    if (out_ >= 0) close(out_);
    out_ = -1;
  }

  void send(int signal) const { kill(pid_, signal); }
  [[nodiscard]] pid_t pid() const { return pid_; }

  // CPU time used so far [s].
  [[nodiscard]] double cpu_s() const {
    std::ifstream stat("/proc/" + std::to_string(pid_) + "/stat");
    std::string word;
    std::vector<std::string> words;
    while (stat >> word) words.push_back(word);
    if (words.size() < 15) return 0.0;
    return (std::stod(words[13]) + std::stod(words[14])) /
           static_cast<double>(sysconf(_SC_CLK_TCK));
  }

  // The exit code (128 + signal when killed); nullopt when it still runs after that time.
  std::optional<int> exit_code(std::chrono::milliseconds within = kPatience) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (!exit_code_) {
      int status = 0;
      if (waitpid(pid_, &status, WNOHANG) == pid_) {
        exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      } else if (std::chrono::steady_clock::now() > end) {
        return std::nullopt;
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    return exit_code_;
  }

  // Waits until stderr has these words, as has() reads them; false after half a minute.
  [[nodiscard]] bool comes_to_say(const std::string& words) const {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!in_order(errors(), words)) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return true;
  }

  // The text written to stderr so far.
  [[nodiscard]] std::string errors() const {
    std::ifstream file(folder_.path() / "stderr");
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static constexpr std::chrono::seconds kPatience{30};  // for sanitizers on a busy machine

 private:
  static Command of_posed(std::vector<std::string> arguments, int most_files) {
    arguments.insert(arguments.begin(), posed_binary().string());
    if (most_files > 0) {
      const std::string limit = "ulimit -n " + std::to_string(most_files);
      arguments.insert(arguments.begin(), {"/bin/sh", "-c", limit + "; exec \"$0\" \"$@\""});
    }
    return Command(std::move(arguments));
  }

  TempFolder folder_;
  pid_t pid_ = -1;
  int out_ = -1;
  std::string text_;
  std::optional<int> exit_code_;
};

}  // namespace posed::test
