// The lab's gloves and their configuration in posed, and the Speaker that makes them send.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/lab/devices.hpp"

namespace posed::lab {

// A glove whose report n has n % modulus in every sensor, so that a mixture of two reports is
// visible.
struct Glove {
  std::string device;  // of lab_devices()
  std::string driver;
  std::string config;  // keys of its [[stream]] besides name and driver
  std::uint32_t modulus = 1;
  std::function<std::vector<std::byte>(std::uint32_t value)> report;
};

std::vector<Glove> gloves();

// Makes a glove send all the time, plugged in or not, and records when it sent each report.
class Speaker {
 public:
  Speaker(LabDevice& device, Glove glove);

  [[nodiscard]] LabDevice& device() const { return device_; }
  [[nodiscard]] const Glove& glove() const { return glove_; }
  [[nodiscard]] const std::string& name() const { return glove_.device; }

  // [n] is the time at which report n, if the kernel took it, was offered to the kernel. The first
  // report is 1.
  [[nodiscard]] std::vector<Moment> said() const;

 private:
  void speak(const std::stop_token& stop);

  LabDevice& device_;
  Glove glove_;
  mutable std::mutex mutex_;
  std::vector<Moment> said_{Moment{}};
  std::jthread thread_;
};

}  // namespace posed::lab
