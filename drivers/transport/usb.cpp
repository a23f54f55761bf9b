#include "drivers/transport/usb.hpp"

#include <libusb.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/node.hpp"
#include "drivers/transport/ports.hpp"

namespace posed::drivers {
namespace {

constexpr std::size_t kMaxReport = 64;  // bytes of a full-speed interrupt packet
constexpr std::size_t kTransfers = 16;  // reports that may come between two reads
constexpr int kMaxFailures = 16;        // in a row: every transfer once
constexpr unsigned kTimeout_ms = 1000;  // of a control transfer
constexpr int kCloseTurns = 10;         // waits for cancelled transfers, a second in all
constexpr timeval kCloseTurn{.tv_sec = 0, .tv_usec = 100'000};
constexpr std::uint8_t kClassInterface = 0x21;  // class request to an interface (USB 2.0, 9.3)
constexpr std::uint8_t kDeviceToHost = 0x80;
constexpr std::uint8_t kGetReport = 0x01, kSetReport = 0x09;  // HID 1.11, 7.2
constexpr std::uint16_t kFeature = 3 << 8;                    // report type in wValue

std::string libusb_says(int code) { return libusb_error_name(code); }

// A context that only handles the one device it is given: without discovery libusb starts no
// thread of its own.
Result<libusb_context*> make_context() {
  libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
  libusb_context* context = nullptr;
  if (const int failed = libusb_init(&context); failed != 0) {
    return fail("libusb does not start (" + libusb_says(failed) + ")");
  }
  return context;
}

}  // namespace

// Owns the node, libusb's context and the claimed interface.
class UsbLink::Impl {
 public:
  Impl(int node, UsbSettings settings, std::string name, std::string identity)
      : node_(node),
        settings_(std::move(settings)),
        name_(std::move(name)),
        identity_(std::move(identity)) {}
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] Result<> claim();

  [[nodiscard]] libusb_context* context() const noexcept { return context_; }
  [[nodiscard]] libusb_device_handle* handle() const noexcept { return handle_; }
  [[nodiscard]] const UsbSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::string& identity() const noexcept { return identity_; }

 private:
  int node_;
  UsbSettings settings_;
  std::string name_, identity_;
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  bool claimed_ = false;
};

UsbLink::Impl::~Impl() {
  if (claimed_) libusb_release_interface(handle_, settings_.interface);
  if (handle_ != nullptr) libusb_close(handle_);
  if (context_ != nullptr) libusb_exit(context_);
  ::close(node_);
}

Result<> UsbLink::Impl::claim() {
  const auto context = make_context();
  if (!context) return std::unexpected(context.error());
  context_ = *context;
  if (const int failed = libusb_wrap_sys_device(context_, node_, &handle_); failed != 0) {
    handle_ = nullptr;
    return fail(name_ + " does not open as a USB device (" + libusb_says(failed) + ")");
  }
  // Such as usbmouse, which takes a P5 for a mouse; it gets the interface back in the end.
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  const int failed = libusb_claim_interface(handle_, settings_.interface);
  if (failed == LIBUSB_ERROR_BUSY) return fail(node_trouble(name_, EBUSY));
  if (failed != 0) return fail(name_ + " gives no interface away (" + libusb_says(failed) + ")");
  claimed_ = true;
  return {};
}

namespace {

// Reports come in by libusb's callbacks, all of them on the thread that calls read(). A transfer
// waits with its report until that is handed over and used, then it goes out again: nothing is
// copied and nothing can overflow but the device's own patience.
class UsbTransport final : public Transport {
 public:
  explicit UsbTransport(std::unique_ptr<UsbLink::Impl> link);
  ~UsbTransport() override;
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  [[nodiscard]] int poll_fd() const noexcept override { return epoll_; }
  [[nodiscard]] Result<> start(std::int64_t now_ns) override;
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  struct Slot {
    UsbTransport* owner = nullptr;
    libusb_transfer* transfer = nullptr;
    std::array<unsigned char, kMaxReport> bytes{};
    bool in_flight = false;
  };

  static void completed(libusb_transfer* transfer) noexcept;
  void take(Slot& slot) noexcept;
  void submit(Slot& slot) noexcept;
  void handle_events(timeval patience) noexcept;
  void cancel_all() noexcept;
  [[nodiscard]] bool any_in_flight() const noexcept;

  std::unique_ptr<UsbLink::Impl> link_;
  int epoll_;
  std::array<Slot, kTransfers> slots_{};
  std::array<Slot*, kTransfers> waiting_{};  // with a report, oldest first from first_
  std::size_t first_ = 0, count_ = 0;
  Slot* handed_over_ = nullptr;  // its bytes are in use until the next read
  int failures_ = 0;             // in a row
  bool lost_ = false;
};

UsbTransport::UsbTransport(std::unique_ptr<UsbLink::Impl> link)
    : link_(std::move(link)), epoll_(::epoll_create1(EPOLL_CLOEXEC)) {
  const libusb_pollfd** descriptors = libusb_get_pollfds(link_->context());
  for (const libusb_pollfd** at = descriptors; at != nullptr && *at != nullptr; ++at) {
    // libusb means poll()'s flags, which epoll shares.
    epoll_event wanted{};
    wanted.events = static_cast<std::uint32_t>((*at)->events);
    ::epoll_ctl(epoll_, EPOLL_CTL_ADD, (*at)->fd, &wanted);
  }
  libusb_free_pollfds(descriptors);
}

UsbTransport::~UsbTransport() {
  cancel_all();
  for (Slot& slot : slots_) {
    // A transfer that the kernel did not give back stays allocated: closing the device forgets it.
    if (!slot.in_flight) libusb_free_transfer(slot.transfer);
  }
  ::close(epoll_);
}

Result<> UsbTransport::start(std::int64_t /*now_ns*/) {
  const UsbSettings& settings = link_->settings();
  for (Slot& slot : slots_) {
    slot.owner = this;
    slot.transfer = libusb_alloc_transfer(0);
    if (slot.transfer == nullptr) return fail("no memory for USB transfers");
    libusb_fill_interrupt_transfer(
        slot.transfer, link_->handle(), settings.endpoint, slot.bytes.data(),
        static_cast<int>(std::min(settings.report_bytes, kMaxReport)), completed, &slot, 0);
    submit(slot);
  }
  if (lost_) return fail(link_->name() + " does not stream; unplug it and plug it in again");
  return {};
}

// RT-safe but for libusb's system calls.
Chunk UsbTransport::read(std::int64_t /*now_ns*/) noexcept {
  if (handed_over_ != nullptr) submit(*std::exchange(handed_over_, nullptr));
  if (count_ == 0 && !lost_) handle_events({});
  if (count_ == 0) return {.bytes = {}, .lost = lost_};
  handed_over_ = waiting_[first_];
  first_ = (first_ + 1) % kTransfers;
  --count_;
  const auto size = static_cast<std::size_t>(handed_over_->transfer->actual_length);
  return {.bytes = std::as_bytes(std::span(handed_over_->bytes)).first(size)};
}

void UsbTransport::completed(libusb_transfer* transfer) noexcept {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  slot.in_flight = false;
  slot.owner->take(slot);
}

void UsbTransport::take(Slot& slot) noexcept {
  switch (slot.transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      failures_ = 0;
      if (slot.transfer->actual_length == 0) return submit(slot);
      waiting_[(first_ + count_) % kTransfers] = &slot;
      ++count_;
      return;
    case LIBUSB_TRANSFER_CANCELLED:
      return;
    case LIBUSB_TRANSFER_NO_DEVICE:
    case LIBUSB_TRANSFER_STALL:
      lost_ = true;
      return;
    default:
      // A bad cable disturbs single packets; an unplugged device fails at every one.
      if (++failures_ >= kMaxFailures) lost_ = true;
      return submit(slot);
  }
}

void UsbTransport::submit(Slot& slot) noexcept {
  if (lost_) return;
  slot.in_flight = libusb_submit_transfer(slot.transfer) == 0;
  if (!slot.in_flight) lost_ = true;
}

void UsbTransport::handle_events(timeval patience) noexcept {
  libusb_handle_events_timeout_completed(link_->context(), &patience, nullptr);
}

bool UsbTransport::any_in_flight() const noexcept {
  return std::ranges::any_of(slots_, &Slot::in_flight);
}

void UsbTransport::cancel_all() noexcept {
  lost_ = true;  // nothing is submitted from here on
  for (Slot& slot : slots_) {
    if (slot.in_flight) libusb_cancel_transfer(slot.transfer);
  }
  for (int turn = 0; turn < kCloseTurns && any_in_flight(); ++turn) handle_events(kCloseTurn);
}

}  // namespace

UsbLink::UsbLink(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
UsbLink::~UsbLink() = default;
UsbLink::UsbLink(UsbLink&&) noexcept = default;
UsbLink& UsbLink::operator=(UsbLink&&) noexcept = default;

const std::string& UsbLink::name() const noexcept { return impl_->name(); }
const std::string& UsbLink::identity() const noexcept { return impl_->identity(); }

Result<std::vector<std::byte>> UsbLink::feature(std::uint8_t report, std::size_t bytes) {
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
  const auto text = std::as_bytes(std::span(answer)).first(static_cast<std::size_t>(got));
  return std::vector<std::byte>(text.begin(), text.end());
}

Result<> UsbLink::set_feature(std::span<const std::byte> report) {
  std::vector<unsigned char> bytes(report.size());
  std::memcpy(bytes.data(), report.data(), report.size());
  const auto number = bytes.empty() ? 0U : bytes.front();
  const int sent = libusb_control_transfer(
      impl_->handle(), kClassInterface, kSetReport, static_cast<std::uint16_t>(kFeature | number),
      static_cast<std::uint16_t>(impl_->settings().interface), bytes.data(),
      static_cast<std::uint16_t>(bytes.size()), kTimeout_ms);
  if (sent == static_cast<int>(bytes.size())) return {};
  return fail(name() + " does not take feature report " + std::to_string(number) + " (" +
              libusb_error_name(sent) + "); unplug it and plug it in again");
}

std::unique_ptr<Transport> make_usb_transport(UsbLink link) {
  return std::make_unique<UsbTransport>(std::move(link.impl_));
}

Result<UsbLink> Ports::usb(const UsbSettings& settings) {
  const auto wanted = [&](const Plugged& one) {
    return one.vendor == settings.vendor && one.product == settings.product;
  };
  const auto chosen = choose(list_usb_devices(), settings.id, wanted, "USB device");
  if (!chosen) return std::unexpected(chosen.error());
  const auto node = open_node(chosen->node);
  if (!node) return std::unexpected(node.error());
  auto impl = std::make_unique<UsbLink::Impl>(*node, settings, chosen->node, chosen->identity());
  if (auto ok = impl->claim(); !ok) return std::unexpected(ok.error());
  return UsbLink(std::move(impl));
}

}  // namespace posed::drivers
