// A pipe that a test can fill before anyone else writes to it.
#pragma once

#include <array>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <unistd.h>

namespace posed::test {

class Pipe {
 public:
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    read_ = ends[0];
    write_ = ends[1];
  }
  ~Pipe() {
    close_reader();
    close_writer();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  // Fills the pipe until no byte fits, so that writers block. Returns its capacity in bytes.
  std::size_t fill() const {
    set_flags(write_, O_NONBLOCK);
    std::size_t held = 0;
    const std::string dots(4096, '.');
    for (const std::size_t step : {dots.size(), std::size_t{1}}) {
      for (ssize_t put = 0; (put = ::write(write_, dots.data(), step)) > 0;) {
        held += static_cast<std::size_t>(put);
      }
    }
    set_flags(write_, 0);
    return held;
  }

  // Reads what is in it, without waiting for more.
  [[nodiscard]] std::string take() const {
    set_flags(read_, O_NONBLOCK);
    std::string all;
    std::array<char, 65536> some{};
    for (ssize_t got = 0; (got = ::read(read_, some.data(), some.size())) > 0;) {
      all.append(some.data(), static_cast<std::size_t>(got));
    }
    set_flags(read_, 0);
    return all;
  }

  void close_reader() { close_end(read_); }
  void close_writer() { close_end(write_); }
  [[nodiscard]] int read_end() const { return read_; }
  [[nodiscard]] int write_end() const { return write_; }

 private:
  static void set_flags(int end, int flags) { fcntl(end, F_SETFL, flags); }
  static void close_end(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }

  int read_ = -1, write_ = -1;
};

}  // namespace posed::test
