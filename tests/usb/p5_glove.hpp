// A simulated P5: its node in usbfs responds as the kernel does for a device with two interfaces,
// feature reports and an interrupt endpoint.
#pragma once

#include <deque>
#include <list>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "tests/usb/bench.hpp"

struct usbdevfs_urb;

namespace posed::test {

class P5Glove {
 public:
  using Bytes = std::vector<std::byte>;

  // `features`: its feature reports, by number.
  P5Glove(Bench& bench, UsbIds ids, std::map<std::uint8_t, Bytes> features);
  ~P5Glove();
  P5Glove(const P5Glove&) = delete;
  P5Glove& operator=(const P5Glove&) = delete;

  void plug();
  // Ends all transfers under way and refuses further ones.
  void unplug();
  // Queues one report until a transfer fetches it.
  void say(std::span<const std::byte> report);

  [[nodiscard]] const std::string& node() const { return node_; }
  // The feature report that the host set last, and an error in the host's calls, if any.
  [[nodiscard]] Bytes last_set() const;
  [[nodiscard]] bool is_claimed() const;

 private:
  // A transfer under way: umockdev's copy of its URB and of the buffer in it.
  struct Transfer {
    IoctlData urb, buffer;
  };

  bool answer(UMockdevIoctlClient* client);
  int submit(UMockdevIoctlData* arg);
  int reap(UMockdevIoctlData* arg);
  int discard(UMockdevIoctlData* arg);
  int control(usbdevfs_urb& urb, std::span<std::byte> buffer);

  Bench& bench_;
  UsbIds ids_;
  std::map<std::uint8_t, Bytes> features_;
  std::string node_;
  std::vector<std::string> paths_;
  int number_ = 40;

  mutable std::mutex mutex_;
  std::list<Transfer> waiting_, done_;
  std::deque<Bytes> reports_;
  Bytes last_set_;
  bool gone_ = true, claimed_ = false;
  IoctlHandler handler_;  // last: its thread uses all of the above
};

}  // namespace posed::test
