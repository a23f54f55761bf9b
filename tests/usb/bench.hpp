// Bench: USB devices that are not there, as umockdev shows them in /sys and /dev of this process
// and of the programs it starts. The program has to run with libumockdev-preload in LD_PRELOAD.
#pragma once

#include <umockdev.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace posed::test {

struct UsbIds {
  std::uint16_t vendor = 0, product = 0;
  std::string serial{};  // empty: it has none
  std::string maker{}, product_name{};
  int port = 1;  // "1-PORT"
};

class Bench {
 public:
  Bench();
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  [[nodiscard]] UMockdevTestbed* testbed() const { return testbed_; }
  // Where a node's file really is.
  [[nodiscard]] std::filesystem::path file_of(const std::string& node) const;

  // Devices in the words of umockdev-record, parents first.
  void add(const std::string& devices);
  // Their paths below /sys, children first.
  void remove(const std::vector<std::string>& paths);

 private:
  UMockdevTestbed* testbed_;
};

// What umockdev-record would say of a USB device with this number, and of its interfaces.
[[nodiscard]] std::string usb_path(const UsbIds& ids);
[[nodiscard]] std::string usb_node(int number);  // "/dev/bus/usb/001/004"
// `content` is what reading its node gives.
[[nodiscard]] std::string describe_usb_device(const UsbIds& ids, int number,
                                              const std::vector<std::uint8_t>& content);
[[nodiscard]] std::string describe_interface(const UsbIds& ids, int interface);

// What the pointer that an ioctl was given points to.
struct FreeData {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
using IoctlData = std::unique_ptr<UMockdevIoctlData, FreeData>;
// `bytes` behind the pointer at `offset` of `from`; empty for a null pointer and a client that has
// gone.
[[nodiscard]] IoctlData resolve(UMockdevIoctlData* from, std::size_t offset, std::size_t bytes);

// Answers everyone who has a node open, on a thread of umockdev's.
class IoctlHandler {
 public:
  // Completes the client's request and says true; false, or none: it goes to the node's file.
  using Answer = std::function<bool(UMockdevIoctlClient*)>;
  struct Answers {
    Answer ioctl{}, read{}, write{};
  };

  explicit IoctlHandler(Answers answers);
  ~IoctlHandler();
  IoctlHandler(const IoctlHandler&) = delete;
  IoctlHandler& operator=(const IoctlHandler&) = delete;

  void attach(const Bench& bench, const std::string& node);

 private:
  Answers answers_;
  UMockdevIoctlBase* base_;
};

}  // namespace posed::test
