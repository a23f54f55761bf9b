// Session: questions and answers over a link to a CyberGlove's box. Cold.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/transport/connection.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

class Session {
 public:
  explicit Session(Connection& link) : link_(link) {}

  // Stops a stream and throws away what was under way.
  [[nodiscard]] Result<> stop();
  // The text about the device; empty when nothing came, whatever came when it is no such text.
  [[nodiscard]] Result<std::string> info();
  // The value bytes behind "?L". They may be zero, so the answer is read by its length.
  [[nodiscard]] Result<std::vector<unsigned>> query(char letter, std::size_t value_bytes);
  // Sends a setting and waits for its echo. Answers of set commands differ by a byte among sources:
  // only the letters count, then the line is drained.
  [[nodiscard]] Result<> set(std::string_view command, std::string_view echo);
  [[nodiscard]] Result<> send(std::string_view bytes) { return link_.write(bytes); }

  [[nodiscard]] const std::string& name() const { return link_.name(); }

 private:
  // Adds what comes until `done(text)` or the patience ends; never an error for silence.
  template <typename Done>
  [[nodiscard]] Result<std::string> listen(std::chrono::milliseconds patience, Done done);

  Connection& link_;
};

}  // namespace posed::drivers::cyberglove
