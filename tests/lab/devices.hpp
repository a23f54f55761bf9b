// The lab's three devices, each a gadget with functions to send through it and to open it on the
// host's side.
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
  bool serial = false;  // a stream of bytes instead of reports
  std::function<void()> plug, unplug;
  std::function<void()> plug_hung;  // plugged in, and takes no bytes and sends none (serial only)
  // Sends from the device; false when the host did not take it.
  std::function<bool(std::span<const std::byte>)> say;
  std::function<Result<std::unique_ptr<drivers::Transport>>()> open;
  // When the kernel created its node; empty while there is none.
  std::function<std::optional<Moment>()> there_since;
};

using LabDevices = std::vector<std::unique_ptr<LabDevice>>;

// One HID device on hidraw, one that only libusb reaches, one on ttyACM. Call it once; the devices
// start unplugged.
LabDevices lab_devices();

}  // namespace posed::lab
