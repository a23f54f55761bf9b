// A serial port without permission; tests/usb has the other nodes.
#include <catch2/catch.hpp>

#include <sys/stat.h>

#include "drivers/transport/transport_factory.hpp"
#include "tests/support/permission.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers {

TEST_CASE("a serial port that may not be opened says which rule mends that") {
  const test::PseudoTerminal terminal;
  REQUIRE(::chmod(terminal.port().c_str(), 0) == 0);
  const test::AsNobody nobody;
  TransportFactory ports;
  const auto link = ports.serial({.port = terminal.port()});
  REQUIRE_FALSE(link);
  test::check_sentence(link.error().message, terminal.port());
}

}  // namespace posed::drivers
