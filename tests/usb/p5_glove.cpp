#include "tests/usb/p5_glove.hpp"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

namespace posed::test {
namespace {

constexpr int kInterface = 1;
constexpr std::uint8_t kEndpoint = 0x82;
constexpr std::size_t kSetup = 8;  // bytes before a control transfer's data
constexpr std::uint8_t kGetReport = 0x01, kSetReport = 0x09, kFeature = 3;
constexpr int kFullSpeed = 2;  // USB_SPEED_FULL of linux/usb/ch9.h

// A device, its configuration, a mouse without an endpoint and the glove.
std::vector<std::uint8_t> descriptors(const UsbIds& ids) {
  const auto low = [](unsigned value) { return static_cast<std::uint8_t>(value & 0xFF); };
  const auto high = [](unsigned value) { return static_cast<std::uint8_t>(value >> 8); };
  return {18,
          1,
          0x10,
          0x01,
          0,
          0,
          0,
          8,
          low(ids.vendor),
          high(ids.vendor),
          low(ids.product),
          high(ids.product),
          0,
          1,
          1,
          2,
          0,
          1,  // device
          9,
          2,
          34,
          0,
          2,
          1,
          0,
          0x80,
          50,  // configuration of 34 bytes
          9,
          4,
          0,
          0,
          0,
          3,
          0,
          0,
          0,  // interface 0
          9,
          4,
          kInterface,
          0,
          1,
          3,
          0,
          0,
          0,  // interface 1
          7,
          5,
          kEndpoint,
          3,
          64,
          0,
          10};  // interrupt, 64 bytes, 10 ms
}

}  // namespace

P5Glove::P5Glove(Bench& bench, UsbIds ids, std::map<std::uint8_t, Bytes> features)
    : bench_(bench),
      ids_(std::move(ids)),
      features_(std::move(features)),
      handler_({.ioctl = [this](UMockdevIoctlClient* client) { return answer(client); }}) {}

P5Glove::~P5Glove() {
  if (!gone_) unplug();
}

void P5Glove::plug() {
  node_ = usb_node(++number_);
  const std::string usb = usb_path(ids_), interface = usb + "/1-" + std::to_string(ids_.port);
  paths_ = {interface + ":1.1", interface + ":1.0", usb};
  const std::lock_guard lock(mutex_);
  handler_.attach(bench_, node_);
  bench_.add(describe_usb_device(ids_, number_, descriptors(ids_)) + describe_interface(ids_, 0) +
             describe_interface(ids_, kInterface));
  reports_.clear();
  gone_ = false;
}

void P5Glove::unplug() {
  bench_.remove(paths_);
  const std::lock_guard lock(mutex_);
  gone_ = true;
}

void P5Glove::say(std::span<const std::byte> report) {
  const std::lock_guard lock(mutex_);
  reports_.emplace_back(report.begin(), report.end());
}

P5Glove::Bytes P5Glove::last_set() const {
  const std::lock_guard lock(mutex_);
  return last_set_;
}

bool P5Glove::is_claimed() const {
  const std::lock_guard lock(mutex_);
  return claimed_;
}

bool P5Glove::answer(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  UMockdevIoctlData* const arg = umockdev_ioctl_client_get_arg(client);
  int result = 0;  // negative: an errno value
  switch (umockdev_ioctl_client_get_request(client)) {
    case USBDEVFS_SUBMITURB:
      result = submit(arg);
      break;
    case USBDEVFS_REAPURBNDELAY:
      result = reap(arg);
      break;
    case USBDEVFS_DISCARDURB:
      result = discard(arg);
      break;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM: {
      const auto claim = resolve(arg, 0, sizeof(unsigned));
      unsigned interface = 0;
      std::memcpy(&interface, claim->data, sizeof interface);
      claimed_ = interface == kInterface;
      result = claimed_ ? 0 : -EINVAL;
      break;
    }
    case USBDEVFS_RELEASEINTERFACE:
      claimed_ = false;
      break;
    case USBDEVFS_IOCTL:  // the kernel driver may be reattached
      break;
    case USBDEVFS_GET_SPEED:
      result = kFullSpeed;
      break;
    case USBDEVFS_GET_CAPABILITIES: {
      const std::uint32_t capabilities = USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      std::memcpy(resolve(arg, 0, sizeof capabilities)->data, &capabilities, sizeof capabilities);
      break;
    }
    case USBDEVFS_CONNECTINFO: {
      const usbdevfs_connectinfo info{.devnum = static_cast<unsigned>(number_), .slow = 0};
      std::memcpy(resolve(arg, 0, sizeof info)->data, &info, sizeof info);
      break;
    }
    case USBDEVFS_CONTROL: {  // which configuration is active
      const auto transfer = resolve(arg, 0, sizeof(usbdevfs_ctrltransfer));
      *resolve(transfer.get(), offsetof(usbdevfs_ctrltransfer, data), 1)->data = 1;
      result = 1;
      break;
    }
    default:
      return false;
  }
  umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? -result : 0);
  return true;
}

int P5Glove::submit(UMockdevIoctlData* arg) {
  if (gone_) return -ENODEV;
  Transfer transfer{.urb = resolve(arg, 0, sizeof(usbdevfs_urb)), .buffer = {}};
  auto& urb = *reinterpret_cast<usbdevfs_urb*>(transfer.urb->data);
  const auto size = static_cast<std::size_t>(urb.buffer_length);
  transfer.buffer = resolve(transfer.urb.get(), offsetof(usbdevfs_urb, buffer), size);
  if (urb.type == USBDEVFS_URB_TYPE_INTERRUPT && urb.endpoint == kEndpoint && claimed_) {
    waiting_.push_back(std::move(transfer));
    return 0;
  }
  if (urb.type != USBDEVFS_URB_TYPE_CONTROL || size < kSetup) return -EINVAL;
  urb.status = control(urb, std::as_writable_bytes(std::span(transfer.buffer->data, size)));
  done_.push_back(std::move(transfer));
  return 0;
}

// Handles class requests for feature reports of the glove's interface; all others stall.
int P5Glove::control(usbdevfs_urb& urb, std::span<std::byte> buffer) {
  const auto at = [&](std::size_t i) { return std::to_integer<std::uint8_t>(buffer[i]); };
  const auto data = buffer.subspan(kSetup);
  const std::uint8_t request = at(1), number = at(2);
  if (!claimed_ || at(3) != kFeature || at(4) != kInterface) return -EPIPE;
  if (request == kGetReport && at(0) == 0xA1 && features_.contains(number)) {
    const Bytes& report = features_.at(number);
    const std::size_t size = std::min(report.size(), data.size());
    std::ranges::copy(std::span(report).first(size), data.begin());
    urb.actual_length = static_cast<int>(size);
    return 0;
  }
  if (request != kSetReport || at(0) != 0x21) return -EPIPE;
  last_set_.assign(data.begin(), data.end());
  urb.actual_length = static_cast<int>(data.size());
  return 0;
}

// The kernel ends the transfers of a device that has gone with -ESHUTDOWN.
int P5Glove::reap(UMockdevIoctlData* arg) {
  if (done_.empty() && !waiting_.empty() && (gone_ || !reports_.empty())) {
    auto& urb = *reinterpret_cast<usbdevfs_urb*>(waiting_.front().urb->data);
    urb.status = gone_ ? -ESHUTDOWN : 0;
    if (!gone_) {
      const Bytes& report = reports_.front();
      const auto room = static_cast<std::size_t>(urb.buffer_length);
      const std::size_t size = std::min(report.size(), room);
      std::memcpy(waiting_.front().buffer->data, report.data(), size);
      urb.actual_length = static_cast<int>(size);
      reports_.pop_front();
    }
    done_.splice(done_.end(), waiting_, waiting_.begin());
  }
  if (done_.empty()) return gone_ ? -ENODEV : -EAGAIN;
  const auto pointer = resolve(arg, 0, sizeof(void*));
  umockdev_ioctl_data_set_ptr(pointer.get(), 0, done_.front().urb.get());
  done_.pop_front();
  return 0;
}

int P5Glove::discard(UMockdevIoctlData* arg) {
  unsigned long address = 0;
  std::memcpy(&address, arg->data, sizeof address);
  const auto at = std::ranges::find_if(
      waiting_, [&](const Transfer& transfer) { return transfer.urb->client_addr == address; });
  if (at == waiting_.end()) return -EINVAL;
  reinterpret_cast<usbdevfs_urb*>(at->urb->data)->status = -ENOENT;
  done_.splice(done_.end(), waiting_, at);
  return 0;
}

}  // namespace posed::test
