#include "drivers/transport/usb.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/node.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/usb_impl.hpp"

namespace posed::drivers {
namespace {

constexpr unsigned kTimeout_ms = 1000;          // of a control transfer
constexpr std::uint8_t kClassInterface = 0x21;  // class request to an interface (USB 2.0, 9.3)
constexpr std::uint8_t kDeviceToHost = 0x80;
constexpr std::uint8_t kGetReport = 0x01, kSetReport = 0x09;  // HID 1.11, 7.2
constexpr std::uint16_t kFeature = 3 << 8;                    // report type in wValue

std::string libusb_says(int code) { return libusb_error_name(code); }

// A context that only handles the given device: without discovery libusb starts no thread.
Result<libusb_context*> make_context() {
  libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
  libusb_context* context = nullptr;
  if (const int failed = libusb_init(&context); failed != 0) {
    return fail("libusb does not start (" + libusb_says(failed) + ")");
  }
  return context;
}

// The interface's endpoint that delivers reports; 0 when it has none. The number differs between
// devices, so it is read and not assumed.
std::uint8_t interrupt_in(libusb_device_handle* handle, int interface) {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(libusb_get_device(handle), &config) != 0) return 0;
  std::uint8_t found = 0;
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    const libusb_interface& at = config->interface[i];
    if (at.num_altsetting < 1 || at.altsetting->bInterfaceNumber != interface) continue;
    for (int e = 0; e < at.altsetting->bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& endpoint = at.altsetting->endpoint[e];
      const bool in = (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_DIR_MASK) != 0;
      const bool interrupt = (endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) ==
                             LIBUSB_ENDPOINT_TRANSFER_TYPE_INTERRUPT;
      if (in && interrupt) found = endpoint.bEndpointAddress;
    }
  }
  libusb_free_config_descriptor(config);
  return found;
}

}  // namespace

UsbLink::Impl::~Impl() {
  if (claimed_) libusb_release_interface(handle_, settings_.interface);
  if (handle_ != nullptr) libusb_close(handle_);
  if (context_ != nullptr) libusb_exit(context_);
  ::close(node_);
}

Result<> UsbLink::Impl::claim() {
  context_ = TRY(make_context());
  if (const int failed = libusb_wrap_sys_device(context_, node_, &handle_); failed != 0) {
    handle_ = nullptr;
    return fail(name_ + " does not open as a USB device (" + libusb_says(failed) + ")");
  }
  // For example usbmouse, which takes a P5 for a mouse; it gets the interface back at the end.
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  const int failed = libusb_claim_interface(handle_, settings_.interface);
  if (failed == LIBUSB_ERROR_BUSY) return fail(node_open_error(name_, EBUSY));
  if (failed != 0) return fail(name_ + " gives no interface away (" + libusb_says(failed) + ")");
  claimed_ = true;
  endpoint_ = interrupt_in(handle_, settings_.interface);
  if (endpoint_ == 0) {
    return fail(name_ + " has no interrupt endpoint on interface " +
                std::to_string(settings_.interface) + "; it is another device than it says");
  }
  return {};
}

UsbLink::UsbLink(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
UsbLink::~UsbLink() = default;
UsbLink::UsbLink(UsbLink&&) noexcept = default;
UsbLink& UsbLink::operator=(UsbLink&&) noexcept = default;

const std::string& UsbLink::name() const noexcept { return impl_->name(); }
const std::string& UsbLink::identity() const noexcept { return impl_->identity(); }

Result<std::vector<std::byte>> UsbLink::feature(std::uint8_t report, std::size_t bytes) {
  if (impl_->cancelled()) return Cancel::error();
  std::vector<unsigned char> answer(bytes);
  const int got =
      libusb_control_transfer(impl_->handle(), kDeviceToHost | kClassInterface, kGetReport,
                              static_cast<std::uint16_t>(kFeature | report),
                              static_cast<std::uint16_t>(impl_->settings().interface),
                              answer.data(), static_cast<std::uint16_t>(bytes), kTimeout_ms);
  if (got < 0) {
    return fail(name() + " does not give feature report " + std::to_string(report) + " (" +
                libusb_error_name(got) + "); unplug it and plug it in again");
  }
  const auto text = std::as_bytes(std::span(answer)).first(got);
  return std::vector<std::byte>(text.begin(), text.end());
}

Result<> UsbLink::set_feature(std::span<const std::byte> report) {
  if (impl_->cancelled()) return Cancel::error();
  std::vector<unsigned char> bytes(report.size());
  std::memcpy(bytes.data(), report.data(), report.size());
  const auto number = bytes.empty() ? 0U : bytes.front();
  const int sent = libusb_control_transfer(
      impl_->handle(), kClassInterface, kSetReport, static_cast<std::uint16_t>(kFeature | number),
      static_cast<std::uint16_t>(impl_->settings().interface), bytes.data(),
      static_cast<std::uint16_t>(bytes.size()), kTimeout_ms);
  if (sent == static_cast<int>(bytes.size())) return {};
  return fail(name() + " does not accept feature report " + std::to_string(number) + " (" +
              libusb_error_name(sent) + "); unplug it and plug it in again");
}

Result<UsbLink> TransportFactory::usb(const UsbSettings& settings) {
  if (only_prepare_) return not_opened();
  const auto wanted = [&](const DeviceInfo& one) {
    return one.vendor == settings.vendor && one.product == settings.product;
  };
  const auto chosen = TRY(choose(list_usb_devices(), settings.id, wanted, "USB device"));
  const auto node = TRY(open_node(chosen.node));
  auto impl =
      std::make_unique<UsbLink::Impl>(node, settings, chosen.node, chosen.identity(), cancel_);
  TRY(impl->claim());
  return UsbLink(std::move(impl));
}

}  // namespace posed::drivers
