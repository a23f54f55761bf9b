// Session: commands and queries over a connection to a CyberGlove's box. Cold.
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

  // Stops a running stream and discards the bytes still arriving.
  [[nodiscard]] Result<> stop();
  // Returns the text about the device; empty when nothing came; otherwise the bytes received, even
  // if they are no such text.
  [[nodiscard]] Result<std::string> info();
  // Returns the value bytes after "?L". They may be zero, so the answer is read by its length.
  [[nodiscard]] Result<std::vector<unsigned>> query(char letter, std::size_t value_bytes);
  // Sends a setting and waits for its echo. Sources differ by a byte about the answer, so only the
  // letters are compared; then the line is drained.
  [[nodiscard]] Result<> set(std::string_view command, std::string_view echo);
  [[nodiscard]] Result<> send(std::string_view bytes) { return link_.write(bytes); }

  [[nodiscard]] const std::string& name() const { return link_.name(); }

 private:
  // Collects bytes until `done(text)` or until the wait is over; silence is not an error.
  template <typename Done>
  [[nodiscard]] Result<std::string> listen(std::chrono::milliseconds patience, Done done);

  Connection& link_;
};

}  // namespace posed::drivers::cyberglove
