// A serial port without permission; tests/usb tests the other device nodes.
#include <catch2/catch.hpp>

#include <sys/stat.h>

#include "drivers/transport/transport_factory.hpp"
#include "tests/support/permission.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers {

TEST_CASE("a serial port without permission names the udev rule that gives access") {
  const test::PseudoTerminal terminal;
  REQUIRE(::chmod(terminal.port().c_str(), 0) == 0);
  const test::AsNobody nobody;
  TransportFactory ports;
  const auto link = ports.serial({.port = terminal.port()});
  REQUIRE_FALSE(link);
  test::check_sentence(link.error().message, terminal.port());
}

}  // namespace posed::drivers
