// Bench: simulated USB devices that umockdev shows in /sys and /dev to this process and to the
// programs that it starts. The program must run with libumockdev-preload in LD_PRELOAD.
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
  std::string serial{};  // empty: no serial number
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
  // The real path of a node's file.
  [[nodiscard]] std::filesystem::path file_of(const std::string& node) const;

  // Adds devices in the format of umockdev-record, parents first.
  void add(const std::string& devices);
  // Removes devices by their paths below /sys, children first.
  void remove(const std::vector<std::string>& paths);

 private:
  UMockdevTestbed* testbed_;
};

// The /sys path of a USB device.
[[nodiscard]] std::string usb_path(const UsbIds& ids);
[[nodiscard]] std::string usb_node(int number);  // "/dev/bus/usb/001/004"
// The device and its interfaces in the format of umockdev-record; reading its node gives `content`.
[[nodiscard]] std::string describe_usb_device(const UsbIds& ids, int number,
                                              const std::vector<std::uint8_t>& content);
[[nodiscard]] std::string describe_interface(const UsbIds& ids, int interface);

// The memory that an ioctl's pointer refers to.
struct FreeData {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
using IoctlData = std::unique_ptr<UMockdevIoctlData, FreeData>;
// Resolves `bytes` bytes behind the pointer at `offset` of `from`; empty for a null pointer and for
// a client that has ended.
[[nodiscard]] IoctlData resolve(UMockdevIoctlData* from, std::size_t offset, std::size_t bytes);

// Handles the ioctls, reads and writes of all clients of a node, on a thread of umockdev.
class IoctlHandler {
 public:
  // Completes the client's request and returns true. False, or an empty function: the request goes
  // to the node's file.
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
