#include "drivers/known_usb.hpp"

#include <vector>

#include "drivers/glove/traits.hpp"

namespace posed::drivers {

bool KnownUsb::fits(const DeviceInfo& device) const noexcept {
  return device.is_usb && device.bus == bus && device.vendor == vendor &&
         ((device.product ^ product) & product_mask) == 0;
}

std::string_view KnownUsb::hand(const DeviceInfo& device) const noexcept {
  if (left_bit == 0) return {};
  return (device.product & left_bit) != 0 ? "left" : "right";
}

std::span<const KnownUsb> known_usb() {
  static const std::vector<KnownUsb> all = [] {
    std::vector<KnownUsb> known;
    for (const Driver& driver : registry()) {
      if (driver.glove == nullptr) continue;
      for (KnownUsb usb : driver.glove->usb) {
        usb.driver = driver.name;
        known.push_back(usb);
      }
    }
    return known;
  }();
  return all;
}

}  // namespace posed::drivers
