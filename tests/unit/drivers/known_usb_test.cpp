// The USB ids of known gloves, and the udev rules that give access to them.
#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "drivers/known_usb.hpp"
#include "tests/support/shared.hpp"

namespace posed::drivers {
namespace {

DeviceInfo plugged(Bus bus, std::uint16_t vendor, std::uint16_t product) {
  DeviceInfo one;
  one.bus = bus;
  one.is_usb = true;
  one.vendor = vendor;
  one.product = product;
  return one;
}

const KnownUsb* known(const DeviceInfo& one) {
  for (const KnownUsb& entry : known_usb()) {
    if (entry.fits(one)) return &entry;
  }
  return nullptr;
}

std::string hex(std::uint16_t number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04x", number);
  return text.data();
}

}  // namespace

TEST_CASE("a 5DT glove's product number says which hand it is for") {
  const auto left = plugged(Bus::kHid, 0x5D70, 0x0011), right = plugged(Bus::kHid, 0x5D70, 0);
  REQUIRE(known(left) != nullptr);
  CHECK(known(left)->driver == "fivedt");
  CHECK(known(left)->hand(left) == "left");
  CHECK(known(right)->hand(right) == "right");
}

TEST_CASE("an adapter and an unknown device do not reveal what is behind them") {
  const auto adapter = plugged(Bus::kSerial, 0x0403, 0x6001);
  REQUIRE(known(adapter) != nullptr);
  CHECK(known(adapter)->adapter);
  CHECK(known(adapter)->hand(adapter).empty());
  CHECK(known(plugged(Bus::kSerial, 0x0403, 0x6002)) == nullptr);
  CHECK(known(plugged(Bus::kHid, 0x0D7F, 0x0100)) == nullptr);
  CHECK(known(DeviceInfo{}) == nullptr);
}

TEST_CASE("the udev rules open every glove that is known") {
  const auto path = test::source_dir() / "config/udev/70-posed.rules";
  std::ifstream file(path);
  REQUIRE(file);
  std::stringstream rules;
  rules << file.rdbuf();
  for (const KnownUsb& entry : known_usb()) {
    std::string line;
    bool opened = false;
    while (std::getline(rules, line)) {
      const bool fits = line.find("\"" + hex(entry.vendor) + "\"") != std::string::npos &&
                        (entry.product_mask == 0 ||
                         line.find("\"" + hex(entry.product) + "\"") != std::string::npos);
      opened |= fits && line.find("TAG+=\"uaccess\"") != std::string::npos;
    }
    INFO(entry.driver);
    CHECK(opened);
    rules.clear();
    rules.seekg(0);
  }
}

}  // namespace posed::drivers
