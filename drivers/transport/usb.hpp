// UsbLink: a USB device for which the kernel makes no node (the P5 glove is on its list of devices
// that HID ignores), spoken to by libusb: reports over control transfers while it is cold, then a
// stream from one interrupt endpoint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

struct UsbSettings {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string id{};   // serial number or port path; empty: the only one
  int interface = 0;  // claimed, a kernel driver on it detached; its interrupt endpoint streams
  std::size_t report_bytes = 64;  // the longest report, at most 64 (full speed)
};

class UsbLink {
 public:
  class Impl;

  explicit UsbLink(std::unique_ptr<Impl> impl) noexcept;
  ~UsbLink();
  UsbLink(UsbLink&&) noexcept;
  UsbLink& operator=(UsbLink&&) noexcept;
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;

  [[nodiscard]] const std::string& name() const noexcept;      // for people
  [[nodiscard]] const std::string& identity() const noexcept;  // stable

  // Cold, at most a second. The feature report with this number, at most `bytes` long: the first
  // byte is what the device puts there, the number as a rule.
  [[nodiscard]] Result<std::vector<std::byte>> feature(std::uint8_t report, std::size_t bytes);
  // Cold, at most a second. `report` begins with its number.
  [[nodiscard]] Result<> set_feature(std::span<const std::byte> report);

 private:
  friend std::unique_ptr<Transport> make_usb_transport(UsbLink link);
  std::unique_ptr<Impl> impl_;
};

// Streams the endpoint's reports, one a chunk. Its poll_fd is an epoll descriptor over libusb's
// own. A device that has gone is `lost`.
[[nodiscard]] std::unique_ptr<Transport> make_usb_transport(UsbLink link);

}  // namespace posed::drivers
