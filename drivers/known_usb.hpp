// Known USB ids of gloves, which the drivers name (glove::GloveTraits). The id of an adapter (FTDI,
// CP210x, CH340) only shows that a glove may be connected to it; the id of a glove identifies the
// glove.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/transport/enumerate.hpp"

namespace posed::drivers {

struct KnownUsb {
  Bus bus = Bus::kSerial;  // how the glove is connected
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t product_mask = 0xFFFF;  // bits of the product that count
  std::string_view driver{};            // registry name; known_usb() fills it in
  bool adapter = false;        // a general-purpose adapter: any device may be connected to it
  std::uint16_t left_bit = 0;  // bit of the product id that is set for a left glove; 0: unknown

  [[nodiscard]] bool fits(const DeviceInfo& device) const noexcept;
  // "right", "left", or empty when the ids do not show it.
  [[nodiscard]] std::string_view hand(const DeviceInfo& device) const noexcept;
};

// The ids of all drivers, in the order of the registry. Cold.
[[nodiscard]] std::span<const KnownUsb> known_usb();

}  // namespace posed::drivers
