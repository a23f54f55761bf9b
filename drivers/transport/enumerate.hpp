// What is device in: serial ports, HID nodes and USB devices with an identity that outlives a
// replug, and why one of them cannot be opened. Everything here is cold and opens no device.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::drivers {

enum class Bus : std::uint8_t { kSerial, kHid, kUsb };

struct DeviceInfo {
  Bus bus = Bus::kSerial;
  std::string node{};  // "/dev/ttyACM0", "/dev/hidraw0", "/dev/bus/usb/001/004"
  bool is_usb = false;
  std::uint16_t vendor = 0, product = 0;
  std::string serial{};      // the device's own number; empty where it has none
  std::string port_path{};   // bus and ports on the way, "1-2.3"; empty when not on USB
  int interface = -1;        // of a device with several; -1 when that is not known
  std::string name{};        // manufacturer and product, as the device says
  std::string open_error{};  // why it cannot be opened and what mends it; empty when it can

  // "0403:6001 A9XYZ", with the port path where there is no serial number, or the node itself.
  [[nodiscard]] std::string identity() const;
  // Whether a config's `id` means this one: serial number, port path ("1-2.3", or "1-2.3:1.0" for
  // one interface) or identity.
  [[nodiscard]] bool answers_to(std::string_view id) const;
};

[[nodiscard]] std::vector<DeviceInfo> list_serial_ports();
[[nodiscard]] std::vector<DeviceInfo> list_hid_nodes();
[[nodiscard]] std::vector<DeviceInfo> list_usb_devices();

// The one of them that answers to `id` (any when empty) and satisfies `wanted`. None or several is
// an error that names what there is; `kind` is for that sentence ("serial port").
[[nodiscard]] Result<DeviceInfo> choose(const std::vector<DeviceInfo>& device,
                                        const std::string& id,
                                        const std::function<bool(const DeviceInfo&)>& wanted,
                                        const std::string& kind);

// The one with this node, whatever link leads there; only the node itself when it is not listed.
[[nodiscard]] DeviceInfo find_node(const std::vector<DeviceInfo>& device, const std::string& path);

}  // namespace posed::drivers
