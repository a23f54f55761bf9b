#include "drivers/transport/node.hpp"

#include <catch2/catch.hpp>

#include <cerrno>
#include <fstream>

#include <unistd.h>

#include "tests/support/temp_folder.hpp"

namespace posed::drivers {
namespace {

TEST_CASE("a node that a service's unit forbids is not blamed on the udev rules") {
  const std::string forbidden = node_open_error("/dev/ttyACM7", EPERM);
  CHECK(forbidden.contains("DeviceAllow=/dev/ttyACM7 rw"));
  CHECK_FALSE(forbidden.contains("udev"));
  CHECK(node_open_error("/dev/ttyACM7", EACCES).contains("udev"));
}

TEST_CASE("nobody is told to join the group that stands for unknown ones") {
  const test::TempFolder folder;
  const auto node = folder.path() / "node";
  std::ofstream(node).put('\n');
  if (::chown(node.c_str(), 0, 65534) != 0) {
    WARN("SKIPPED without root: only root gives a node to a group");
    return;
  }
  CHECK_FALSE(node_open_error(node.string(), EACCES).contains("usermod"));
}

}  // namespace
}  // namespace posed::drivers
