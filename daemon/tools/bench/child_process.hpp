// ChildProcess: a part of a benchmark that runs in a process of its own, so that its CPU time is
// not counted with the daemon's. Parent and child talk through two pipes.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>

#include "proto/frame/result.hpp"

namespace posed::tools {

// One end of both pipes.
class PipePair {
 public:
  PipePair(int from, int to) : from_(from), to_(to) {}
  PipePair(PipePair&& other) noexcept
      : from_(std::exchange(other.from_, -1)), to_(std::exchange(other.to_, -1)) {}
  PipePair& operator=(PipePair&&) = delete;
  ~PipePair();

  [[nodiscard]] int from() const noexcept { return from_; }  // to poll
  [[nodiscard]] int to() const noexcept { return to_; }
  // Without its end of line; empty when the other side has closed.
  [[nodiscard]] std::string read_line() const;
  bool write_line(const std::string& line) const {
    return write(line.data(), line.size()) && end_line();
  }
  // All bytes, or false.
  bool read(void* data, std::size_t size) const;
  bool write(const void* data, std::size_t size) const;
  // The other side reads an end of file.
  void close_to();

 private:
  bool end_line() const { return write("\n", 1); }
  int from_, to_;
};

class ChildProcess {
 public:
  // Forks; `run` is what the child does, without any other descriptor of the parent. Call before
  // the process has a second thread or a ZeroMQ context. `gives_way`: whenever others want the CPU,
  // the child waits, as a program on another machine would not disturb this one.
  static Result<ChildProcess> fork(const std::function<int(PipePair& parent)>& run,
                                   bool gives_way = false);
  ChildProcess(ChildProcess&& other) noexcept
      : process_(std::exchange(other.process_, -1)), pipes_(std::move(other.pipes_)) {}
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();  // closes the pipe to the child and waits until it has ended

  [[nodiscard]] PipePair& pipes() noexcept { return pipes_; }

 private:
  ChildProcess(int process, PipePair pipes) : process_(process), pipes_(std::move(pipes)) {}
  int process_;
  PipePair pipes_;
};

}  // namespace posed::tools
