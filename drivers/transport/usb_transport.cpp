// The hot part of a UsbLink: delivers its reports, one per chunk.
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "drivers/transport/usb_impl.hpp"

namespace posed::drivers {
namespace {

constexpr std::size_t kMaxReport = 64;  // bytes of a full-speed interrupt packet
constexpr std::size_t kTransfers = 16;  // reports that may arrive between two reads
constexpr int kMaxFailures = 16;        // in a row: as many as there are transfers
constexpr int kCloseTurns = 10;         // waits for cancelled transfers, a second in all
constexpr timeval kCloseTurn{.tv_sec = 0, .tv_usec = 100'000};

// libusb delivers reports through callbacks, all on the thread that calls read(). A transfer keeps
// its report until that has been handed over and used, then it is submitted again: nothing is
// copied, and no queue can overflow except the device's own.
class UsbTransport final : public Transport {
 public:
  explicit UsbTransport(std::unique_ptr<UsbLink::Impl> link);
  ~UsbTransport() override;
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  [[nodiscard]] int poll_fd() const noexcept override { return epoll_; }
  Result<> start(std::int64_t now_ns) override;
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;

 private:
  struct Slot {
    UsbTransport* owner = nullptr;
    libusb_transfer* transfer = nullptr;
    std::array<unsigned char, kMaxReport> bytes{};
    bool in_flight = false;
  };

  static void completed(libusb_transfer* transfer) noexcept;
  void accept(Slot& slot) noexcept;
  void submit(Slot& slot) noexcept;
  void handle_events(timeval patience) noexcept;
  void cancel_all() noexcept;
  [[nodiscard]] bool any_in_flight() const noexcept;

  std::unique_ptr<UsbLink::Impl> link_;
  int epoll_;
  std::array<Slot, kTransfers> slots_{};
  std::array<Slot*, kTransfers> waiting_{};  // transfers with a report, oldest first from first_
  std::size_t first_ = 0, count_ = 0;
  Slot* handed_over_ = nullptr;  // its bytes are in use until the next read
  int failures_ = 0;             // in a row
  bool lost_ = false;
};

UsbTransport::UsbTransport(std::unique_ptr<UsbLink::Impl> link)
    : link_(std::move(link)), epoll_(::epoll_create1(EPOLL_CLOEXEC)) {
  const libusb_pollfd** descriptors = libusb_get_pollfds(link_->context());
  for (const libusb_pollfd** at = descriptors; at != nullptr && *at != nullptr; ++at) {
    // libusb uses the flags of poll(), which have the same values for epoll.
    epoll_event wanted{};
    wanted.events = static_cast<std::uint32_t>((*at)->events);
    ::epoll_ctl(epoll_, EPOLL_CTL_ADD, (*at)->fd, &wanted);
  }
  libusb_free_pollfds(descriptors);
}

UsbTransport::~UsbTransport() {
  cancel_all();
  for (Slot& slot : slots_) {
    // A transfer that the kernel did not return stays allocated; closing the device releases it.
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
        slot.transfer, link_->handle(), link_->endpoint(), slot.bytes.data(),
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
  const std::size_t size = handed_over_->transfer->actual_length;
  return {.bytes = std::as_bytes(std::span(handed_over_->bytes)).first(size)};
}

void UsbTransport::completed(libusb_transfer* transfer) noexcept {
  Slot& slot = *static_cast<Slot*>(transfer->user_data);
  slot.in_flight = false;
  slot.owner->accept(slot);
}

void UsbTransport::accept(Slot& slot) noexcept {
  switch (slot.transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      failures_ = 0;
      if (slot.transfer->actual_length == 0) return submit(slot);
      assert(count_ < kTransfers);  // one for each transfer, so it never overflows
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
      // A bad cable disturbs single packets; an unplugged device fails on every one.
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
  lost_ = true;  // no transfer is submitted from here on
  for (Slot& slot : slots_) {
    if (slot.in_flight) libusb_cancel_transfer(slot.transfer);
  }
  for (int turn = 0; turn < kCloseTurns && any_in_flight(); ++turn) handle_events(kCloseTurn);
}

}  // namespace

std::unique_ptr<Transport> make_usb_transport(UsbLink link) {
  return std::make_unique<UsbTransport>(std::move(link.impl_));
}

}  // namespace posed::drivers
