#include "drivers/known_usb.hpp"

#include <array>

namespace posed::drivers {
namespace {

constexpr std::array kKnown{
    // CyberGlove III: an FTDI chip (see its user guide); the id is that chip's default.
    KnownUsb{.vendor = 0x0403, .product = 0x6001, .driver = "cyberglove", .adapter = true},
    // LucidGloves: the two USB-serial bridges of ESP32 and Arduino boards that opengloves-driver
    // looks for (it lists 1A86:7524, but a CH340 is 1A86:7523).
    KnownUsb{.vendor = 0x10C4, .product = 0xEA60, .driver = "lucidgloves", .adapter = true},
    KnownUsb{.vendor = 0x1A86, .product = 0x7523, .driver = "lucidgloves", .adapter = true},
    // 5DT Ultra: every product of the vendor is a glove; bit 0 marks a left one (VRPN's 5dtUSB).
    KnownUsb{
        .bus = Bus::kHid, .vendor = 0x5D70, .product_mask = 0, .driver = "fivedt", .left_bit = 1},
    // P5 (libp5glove). The kernel's HID layer ignores it, so there is no hidraw node.
    KnownUsb{.bus = Bus::kUsb, .vendor = 0x0D7F, .product = 0x0100, .driver = "p5"},
};

}  // namespace

bool KnownUsb::fits(const DeviceInfo& device) const noexcept {
  return device.is_usb && device.bus == bus && device.vendor == vendor &&
         ((device.product ^ product) & product_mask) == 0;
}

std::string_view KnownUsb::hand(const DeviceInfo& device) const noexcept {
  if (left_bit == 0) return {};
  return (device.product & left_bit) != 0 ? "left" : "right";
}

std::span<const KnownUsb> known_usb() { return kKnown; }

}  // namespace posed::drivers
