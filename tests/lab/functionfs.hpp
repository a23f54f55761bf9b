// A HID device that answers feature reports, on FunctionFS: the kernel's own HID gadget answers
// GET_REPORT with zeros, but a P5 glove gives the positions of its LEDs in feature reports.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace posed::lab {

class FunctionFsHid {
 public:
  using Bytes = std::vector<std::byte>;

  struct Reports {
    std::function<Bytes(std::uint8_t report)> get;  // the feature report with this number
    std::function<void(std::span<const std::byte>)> set;
  };

  // Mounts `name` at `folder` and writes the descriptors: `interfaces` interfaces of class HID,
  // with an interrupt IN endpoint on the last. Call it between Gadget::add_functionfs and the first
  // plug().
  FunctionFsHid(const std::string& name, const std::filesystem::path& folder, int interfaces,
                Reports reports);
  ~FunctionFsHid();
  FunctionFsHid(const FunctionFsHid&) = delete;
  FunctionFsHid& operator=(const FunctionFsHid&) = delete;

  // Sends one input report and waits until the host takes it. False when the device is unplugged.
  bool send(std::span<const std::byte> report);

 private:
  void answer_events(const std::stop_token& stop);
  void answer(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t length);

  Reports reports_;
  int control_ = -1, input_ = -1;
  std::jthread events_;
};

}  // namespace posed::lab
