// Lists the connected devices: serial ports, HID nodes and USB devices, each with an identity that
// stays the same when it is replugged, and the reason if it cannot be opened. Everything here is
// cold and opens no device.
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
  std::string serial{};      // the device's own number; empty if it has none
  std::string port_path{};   // bus and ports on the path, "1-2.3"; empty when not on USB
  int interface = -1;        // of a device with several; -1 when not known
  std::string name{};        // manufacturer and product, as reported by the device
  std::string open_error{};  // why it cannot be opened and how to fix it; empty when it can

  // "0403:6001 A9XYZ"; without a serial number, with the port path instead, or the node itself.
  [[nodiscard]] std::string identity() const;
  // True when an `id` in a config means this device: serial number, port path ("1-2.3", or
  // "1-2.3:1.0" for one interface) or identity.
  [[nodiscard]] bool answers_to(std::string_view id) const;
};

[[nodiscard]] std::vector<DeviceInfo> list_serial_ports();
[[nodiscard]] std::vector<DeviceInfo> list_hid_nodes();
[[nodiscard]] std::vector<DeviceInfo> list_usb_devices();

// Returns the one that answers to `id` (any when empty) and satisfies `wanted`. When none or
// several match, the error lists the candidates; `kind` is used in it ("serial port").
Result<DeviceInfo> choose(const std::vector<DeviceInfo>& device, const std::string& id,
                          const std::function<bool(const DeviceInfo&)>& wanted,
                          const std::string& kind);

// Returns the one with this node, also through a link; only the node itself when it is not listed.
[[nodiscard]] DeviceInfo find_node(const std::vector<DeviceInfo>& device, const std::string& path);

}  // namespace posed::drivers
