// A pseudo-terminal: the test holds the glove's side, the code under test opens the port's.
#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include <catch2/catch.hpp>

namespace posed::test {

class PseudoTerminal {
 public:
  PseudoTerminal() : fd_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    REQUIRE(fd_ >= 0);
    REQUIRE(::grantpt(fd_) == 0);
    REQUIRE(::unlockpt(fd_) == 0);
    std::array<char, 64> name{};
    REQUIRE(::ptsname_r(fd_, name.data(), name.size()) == 0);
    port_ = name.data();
  }
  ~PseudoTerminal() { unplug(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  [[nodiscard]] const std::string& port() const { return port_; }
  [[nodiscard]] int fd() const { return fd_; }

  void say(std::string_view text) const {
    REQUIRE(::write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  [[nodiscard]] std::string received() const {
    std::array<char, 4096> text{};
    const ssize_t got = ::read(fd_, text.data(), text.size());
    return {text.data(), static_cast<std::size_t>(got < 0 ? 0 : got)};
  }
  void unplug() {
    if (const int fd = std::exchange(fd_, -1); fd >= 0) ::close(fd);
  }

 private:
  int fd_;
  std::string port_;
};

}  // namespace posed::test
