// HID gloves. hidapi lists the devices; the reports are read from the hidraw node's own descriptor,
// because hidapi hides it and a reader thread that polls all devices at once needs one. Each read
// of the node returns one whole report, which is all that hidapi's hid_read does.
#include "drivers/transport/hid_transport.hpp"

#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/node.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {

Result<Connection> TransportFactory::hid(const HidSettings& settings) {
  if (only_prepare_) return not_opened();
  const auto nodes = list_hid_nodes();
  auto chosen = find_node(nodes, settings.path);
  if (settings.path.empty()) {
    const auto wanted = [&](const DeviceInfo& one) {
      return one.is_usb && one.vendor == settings.vendor &&
             (settings.products.empty() ||
              std::ranges::find(settings.products, one.product) != settings.products.end());
    };
    chosen = TRY(choose(nodes, settings.id, wanted, "HID node"));
  }
  const auto fd = TRY(open_node(chosen.node));
  Connection link(fd, chosen.node, chosen.identity());
  link.heed(cancel_);
  hidraw_devinfo info{};
  if (::ioctl(fd, HIDIOCGRAWINFO, &info) != 0) {
    return fail(chosen.node + " is no HID device; see `posed devices` for those that are");
  }
  return link;
}

HidTransport::HidTransport(Connection link)
    : fd_(link.fd()), reader_(make_link_transport(std::move(link))) {}

// RT-safe but for the write to the eventfd.
bool HidTransport::send(std::span<const std::byte> bytes, std::uint8_t /*socket*/) noexcept {
  if (bytes.size() > sending_.bytes.size()) return false;
  sending_.size = bytes.size();
  std::memcpy(sending_.bytes.data(), bytes.data(), bytes.size());
  const bool queued = queue_.push(sending_);
  if (!queued) dropped_.fetch_add(1, std::memory_order_relaxed);
  waiting_.signal();
  return queued;
}

void HidTransport::write_waiting() noexcept {
  waiting_.clear();
  while (queue_.read_available() > 0) {
    // Messages that piled up behind a slow write: only the newest still matter.
    while (queue_.read_available() > kBacklog) {
      queue_.pop();
      dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    queue_.consume_one([this](const Report& report) {
      // If the device is gone, the reader notices; a report that it does not accept is lost.
      [[maybe_unused]] const ssize_t sent = ::write(fd_, report.bytes.data(), report.size);
    });
  }
}

std::unique_ptr<Transport> make_hid_transport(Connection link) {
  return std::make_unique<HidTransport>(std::move(link));
}

}  // namespace posed::drivers
