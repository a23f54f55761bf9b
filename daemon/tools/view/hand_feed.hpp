// HandFeed: sends the hands of a page's camera to the landmarks source of the daemon on this
// computer (drivers/landmarks), where that daemon says that it listens. Cold.
#pragma once

#include <string>
#include <string_view>

namespace posed::view {

class HandFeed {
 public:
  HandFeed() = default;
  ~HandFeed() { close(); }
  HandFeed(const HandFeed&) = delete;
  HandFeed& operator=(const HandFeed&) = delete;

  // Sends one message, without waiting; returns why nobody gets it, empty if somebody listens.
  // `source`: the source's identity as the daemon publishes it, "udp 127.0.0.1:7420"; empty if the
  // daemon has none.
  [[nodiscard]] std::string send(std::string_view source, std::string_view json);

 private:
  void connect(std::string_view source);
  void close();

  std::string source_;
  int fd_ = -1;  // connected; -1: there is nothing to send to, or the system has no more
};

}  // namespace posed::view
