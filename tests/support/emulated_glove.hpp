// A glove on a serial port of its own, as a process: `posed emulate`. It is plugged in while this
// object exists.
#pragma once

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "tests/support/process.hpp"

namespace posed::test {

class EmulatedGlove {
 public:
  // `port`: where the code under test looks for the glove, a path in the folder of the test.
  explicit EmulatedGlove(const std::string& port, const std::vector<std::string>& options = {})
      : port_(port), process_(words(port, options)) {
    const auto ready = process_.line();
    INFO(process_.errors());
    REQUIRE(ready);
    REQUIRE(std::filesystem::is_symlink(port_));
  }
  ~EmulatedGlove() { remove_port(); }
  EmulatedGlove(const EmulatedGlove&) = delete;
  EmulatedGlove& operator=(const EmulatedGlove&) = delete;

  // Pulls the cable: nothing of the emulator's own end runs any more.
  void pull() {
    remove_port();
    process_.send(SIGKILL);
    CHECK(process_.exit_code() == 128 + SIGKILL);
  }
  // Ends it as a user does who presses Ctrl-C.
  void end() {
    process_.send(SIGTERM);
    CHECK(process_.exit_code() == 0);
    CHECK_FALSE(std::filesystem::is_symlink(port_));
  }

 private:
  static std::vector<std::string> words(const std::string& port,
                                        const std::vector<std::string>& options) {
    std::vector<std::string> all{"emulate", "lucidgloves", "--link", port};
    all.insert(all.end(), options.begin(), options.end());
    return all;
  }
  // As udev does for a real glove. A killed emulator would leave the path behind, which leads to a
  // pseudo-terminal whose number the kernel gives to the next one: the code under test would look
  // for its glove there, and read from the terminal of another test.
  void remove_port() const {
    std::error_code ignored;
    std::filesystem::remove(port_, ignored);
  }

  std::filesystem::path port_;
  Process process_;
};

}  // namespace posed::test
