// The lab's three devices, each a gadget with a way to speak through it and a way to open it from
// the host's side.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::lab {

using Moment = std::chrono::steady_clock::time_point;

struct LabDevice {
  std::string name;
  bool serial = false;  // bytes, not reports
  std::function<void()> plug, unplug;
  // From the device: false when the host did not take it.
  std::function<bool(std::span<const std::byte>)> say;
  std::function<Result<std::unique_ptr<drivers::Transport>>()> open;
  // When the kernel made its node; nothing while there is none.
  std::function<std::optional<Moment>()> there_since;
};

using LabDevices = std::vector<std::unique_ptr<LabDevice>>;

// One HID device on hidraw, one that only libusb reaches, one on ttyACM. To be made once;
// unplugged.
LabDevices lab_devices();

}  // namespace posed::lab
