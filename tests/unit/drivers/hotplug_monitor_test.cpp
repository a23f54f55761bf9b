// The monitor of device nodes, tested on folders in place of /dev.
#include <poll.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "drivers/transport/hotplug_monitor.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::drivers {
namespace {

bool readable(const HotplugMonitor& arrivals) {
  pollfd wanted{.fd = arrivals.poll_fd(), .events = POLLIN, .revents = 0};
  return ::poll(&wanted, 1, 0) == 1;
}

void make_node(const std::filesystem::path& path) { std::ofstream{path} << ""; }

}  // namespace

TEST_CASE("a node that appears, or becomes accessible, is reported once") {
  const test::TempFolder dev;
  HotplugMonitor arrivals(dev.path());
  REQUIRE(arrivals.poll_fd() >= 0);
  CHECK_FALSE(arrivals.consume());
  make_node(dev.path() / "ttyACM0");
  CHECK(readable(arrivals));
  CHECK(arrivals.consume());
  CHECK_FALSE(readable(arrivals));
  CHECK_FALSE(arrivals.consume());
  std::filesystem::permissions(dev.path() / "ttyACM0", std::filesystem::perms::owner_read);
  CHECK(arrivals.consume());
  std::filesystem::remove(dev.path() / "ttyACM0");
  CHECK_FALSE(arrivals.consume());
}

TEST_CASE("a USB bus that appears later is watched, too") {
  const test::TempFolder dev;
  HotplugMonitor arrivals(dev.path());
  std::filesystem::create_directory(dev.path() / "bus");
  CHECK(arrivals.consume());
  std::filesystem::create_directories(dev.path() / "bus/usb");
  CHECK(arrivals.consume());
  std::filesystem::create_directory(dev.path() / "bus/usb/001");
  CHECK(arrivals.consume());
  make_node(dev.path() / "bus/usb/001/004");
  CHECK(arrivals.consume());
}

}  // namespace posed::drivers
