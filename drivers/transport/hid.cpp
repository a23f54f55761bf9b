// HID gloves. hidapi lists the devices; the reports are read from the hidraw node's own descriptor,
// because hidapi hides it and a reader thread that polls all devices at once needs one. Each read
// of the node returns one whole report, which is all that hidapi's hid_read does.
#include <linux/hidraw.h>
#include <sys/ioctl.h>

#include <algorithm>

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
    auto found = choose(nodes, settings.id, wanted, "HID node");
    if (!found) return std::unexpected(found.error());
    chosen = std::move(*found);
  }
  const auto fd = open_node(chosen.node);
  if (!fd) return std::unexpected(fd.error());
  Connection link(*fd, chosen.node, chosen.identity());
  link.heed(cancel_);
  hidraw_devinfo info{};
  if (::ioctl(*fd, HIDIOCGRAWINFO, &info) != 0) {
    return fail(chosen.node + " is no HID device; see `posed devices` for those that are");
  }
  return link;
}

}  // namespace posed::drivers
