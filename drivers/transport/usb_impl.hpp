// The private part of UsbLink: the node, libusb's context and the claimed interface. Included only
// by usb.cpp and usb_transport.cpp.
#pragma once

#include <libusb.h>

#include <memory>
#include <string>

#include "drivers/transport/cancel.hpp"
#include "drivers/transport/usb.hpp"

namespace posed::drivers {

class UsbLink::Impl {
 public:
  Impl(int node, UsbSettings settings, std::string name, std::string identity,
       std::shared_ptr<const Cancel> cancel)
      : node_(node),
        settings_(std::move(settings)),
        name_(std::move(name)),
        identity_(std::move(identity)),
        cancel_(std::move(cancel)) {}
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Result<> claim();

  // A transfer that has begun takes up to a second; after a cancel no transfer is begun.
  [[nodiscard]] bool cancelled() const noexcept { return cancel_->fired(); }

  [[nodiscard]] libusb_context* context() const noexcept { return context_; }
  [[nodiscard]] std::uint8_t endpoint() const noexcept { return endpoint_; }
  [[nodiscard]] libusb_device_handle* handle() const noexcept { return handle_; }
  [[nodiscard]] const UsbSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::string& identity() const noexcept { return identity_; }

 private:
  int node_;
  UsbSettings settings_;
  std::string name_, identity_;
  std::shared_ptr<const Cancel> cancel_;
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::uint8_t endpoint_ = 0;
  bool claimed_ = false;
};

}  // namespace posed::drivers
