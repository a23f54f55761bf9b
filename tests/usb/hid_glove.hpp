// A simulated glove on a hidraw node.
#pragma once

#include <deque>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "tests/usb/bench.hpp"

namespace posed::test {

class HidGlove {
 public:
  using Bytes = std::vector<std::byte>;

  HidGlove(Bench& bench, UsbIds ids);
  ~HidGlove();
  HidGlove(const HidGlove&) = delete;
  HidGlove& operator=(const HidGlove&) = delete;

  // Uses a node with a new number each time, because a glove must be found by its identity and not
  // by its node.
  void plug();
  void unplug();
  // Sends one report; false when it is not plugged in or the host has 64 unread reports.
  bool say(std::span<const std::byte> report);
  // What the host wrote to it since the last call.
  [[nodiscard]] Bytes received();

  [[nodiscard]] const std::string& node() const { return node_; }

 private:
  // Whether this client's node is the glove's present node.
  bool has_open(UMockdevIoctlClient* client) const;
  bool answer(UMockdevIoctlClient* client);
  bool answer_read(UMockdevIoctlClient* client);
  bool answer_write(UMockdevIoctlClient* client);

  Bench& bench_;
  UsbIds ids_;
  int number_ = 0;
  std::string node_;
  std::vector<std::string> paths_;  // children first

  std::mutex mutex_;  // guards what follows; one thread plugs, others send and handle requests
  int bell_ = -1;     // the node is a FIFO that holds a byte for every report
  std::deque<Bytes> reports_;
  Bytes received_;
  IoctlHandler handler_;  // last: its thread uses all of the above
};

}  // namespace posed::test
