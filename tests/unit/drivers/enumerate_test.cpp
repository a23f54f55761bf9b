// Which plugged-in device an id selects, and the errors when no device or several match.
#include <catch2/catch.hpp>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers {
namespace {

DeviceInfo adapter(const std::string& node, const std::string& serial,
                   const std::string& port_path) {
  DeviceInfo plugged;
  plugged.node = node;
  plugged.is_usb = true;
  plugged.vendor = 0x10C4;
  plugged.product = 0xEA60;
  plugged.serial = serial;
  plugged.port_path = port_path;
  plugged.interface = 0;
  return plugged;
}

bool any(const DeviceInfo& /*plugged*/) { return true; }

bool mentions(const Error& error, const std::string& text) {
  return error.message.find(text) != std::string::npos;
}

}  // namespace

TEST_CASE("a device is known by its serial number, its port path or both with its USB ids") {
  const DeviceInfo plain = adapter("/dev/ttyUSB0", "A9XYZ", "1-2.3");
  CHECK(plain.identity() == "10c4:ea60 A9XYZ");
  for (const char* id : {"A9XYZ", "1-2.3", "1-2.3:1.0", "10c4:ea60 A9XYZ"}) {
    CHECK(plain.answers_to(id));
  }
  for (const char* id : {"", "A9XY", "1-2", "1-2.3:1.1", "/dev/ttyUSB0"}) {
    CHECK_FALSE(plain.answers_to(id));
  }
  CHECK(adapter("/dev/ttyUSB0", "", "1-2.3").identity() == "10c4:ea60 1-2.3");
  DeviceInfo built_in;
  built_in.node = "/dev/ttyS0";
  CHECK(built_in.identity() == "/dev/ttyS0");
  CHECK_FALSE(built_in.answers_to(""));
}

TEST_CASE("devices with equal serial numbers are distinguished by their port paths") {
  const std::vector twins{adapter("/dev/ttyUSB0", "0001", "1-1"),
                          adapter("/dev/ttyUSB1", "0001", "1-2")};
  const auto unclear = choose(twins, "0001", any, "serial port");
  REQUIRE_FALSE(unclear);
  CHECK(mentions(unclear.error(), "/dev/ttyUSB0"));
  CHECK(mentions(unclear.error(), "/dev/ttyUSB1"));
  CHECK(mentions(unclear.error(), "port path"));
  const auto clear = choose(twins, "1-2", any, "serial port");
  REQUIRE(clear);
  CHECK(clear->node == "/dev/ttyUSB1");
}

TEST_CASE("an id without a device is named") {
  const std::vector one{adapter("/dev/ttyUSB0", "0001", "1-1")};
  const auto none = choose(one, "0002", any, "serial port");
  REQUIRE_FALSE(none);
  CHECK(mentions(none.error(), "0002"));
  CHECK(mentions(none.error(), "posed devices"));
  CHECK(choose(one, "", any, "serial port"));
  CHECK_FALSE(choose(one, "", [](const DeviceInfo& p) { return p.vendor == 1; }, "serial port"));
}

TEST_CASE("ports, HID nodes and USB devices that do not exist are refused with an error message") {
  constexpr std::uint32_t kNobody = 0xFFF0;  // no vendor has this id
  TransportFactory ports;
  const auto port = ports.serial({.id = "no-such-glove"});
  REQUIRE_FALSE(port);
  CHECK(mentions(port.error(), "no-such-glove"));
  CHECK_FALSE(ports.serial({.usb_ids = {kNobody << 16}}));
  CHECK_FALSE(ports.hid({.vendor = std::uint16_t{kNobody}}));
  CHECK_FALSE(ports.usb({.vendor = std::uint16_t{kNobody}, .product = 1}));
  const auto missing = ports.hid({.path = "/dev/hidrawNotThere"});
  REQUIRE_FALSE(missing);
  CHECK(mentions(missing.error(), "is not there"));
  const auto foreign = ports.hid({.path = "/dev/null"});
  REQUIRE_FALSE(foreign);
  CHECK(mentions(foreign.error(), "no HID device"));
}

TEST_CASE("a port that is not on USB is identified by its name") {
  const test::PseudoTerminal terminal;
  TransportFactory ports;
  const auto link = ports.serial({.port = terminal.port()});
  REQUIRE(link);
  CHECK(link->identity() == terminal.port());
}

}  // namespace posed::drivers
