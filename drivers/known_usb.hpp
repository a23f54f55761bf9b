// The USB ids that gloves are known by. Ids of adapters (FTDI, CP210x, CH340) only say what may be
// behind them; those of gloves say what is.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/transport/enumerate.hpp"

namespace posed::drivers {

struct KnownUsb {
  Bus bus = Bus::kSerial;  // how the glove is reached
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t product_mask = 0xFFFF;  // bits of the product that count
  std::string_view driver;              // registry name
  bool adapter = false;                 // anything may be behind it
  std::uint16_t left_bit = 0;           // of the product: set for a left glove; 0: not told

  [[nodiscard]] bool fits(const DeviceInfo& device) const noexcept;
  // "right", "left", or empty where the ids do not tell.
  [[nodiscard]] std::string_view hand(const DeviceInfo& device) const noexcept;
};

[[nodiscard]] std::span<const KnownUsb> known_usb();

}  // namespace posed::drivers
