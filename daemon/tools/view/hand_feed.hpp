// HandFeed: sends the hands of a page's camera to the landmarks source of the daemon on this
// computer (drivers/landmarks). Nothing from the network picks the address. Cold.
#pragma once

#include <string>
#include <string_view>

namespace posed::view {

class HandFeed {
 public:
  HandFeed();
  ~HandFeed();
  HandFeed(const HandFeed&) = delete;
  HandFeed& operator=(const HandFeed&) = delete;

  // Sends one message, without waiting; returns why nobody gets it, empty if somebody listens.
  [[nodiscard]] std::string send(std::string_view json);

 private:
  int fd_ = -1;  // connected; -1: the system has no more
};

}  // namespace posed::view
