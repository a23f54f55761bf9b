// UsbLink: a USB device for which the kernel makes no node (the P5 glove is on the kernel's list of
// devices that HID ignores), accessed through libusb: first reports over control transfers (cold),
// then a stream from one interrupt endpoint.
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
  int interface = 0;  // claimed, with its kernel driver detached; its interrupt endpoint streams
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

  // Cold, at most a second. Reads the feature report with this number, at most `bytes` long. Its
  // first byte comes from the device and usually is the number.
  Result<std::vector<std::byte>> feature(std::uint8_t report, std::size_t bytes);
  // Cold, at most a second. `report` begins with its number.
  Result<> set_feature(std::span<const std::byte> report);

 private:
  friend std::unique_ptr<Transport> make_usb_transport(UsbLink link);
  std::unique_ptr<Impl> impl_;
};

// Streams the endpoint's reports, one per chunk. Its poll_fd is an epoll descriptor over those of
// libusb. A device that has gone sets `lost`.
[[nodiscard]] std::unique_ptr<Transport> make_usb_transport(UsbLink link);

}  // namespace posed::drivers
