// The latency timer of a USB serial adapter, in a folder that stands for /sys.
#include "drivers/transport/node.hpp"

#include <catch2/catch.hpp>

#include "tests/support/file_text.hpp"
#include "tests/support/permission.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::drivers {
namespace {

struct Adapter {
  explicit Adapter(const std::string& latency) {
    const auto port = folder.path() / "bus/usb-serial/devices/ttyUSB7";
    std::filesystem::create_directories(port);
    timer = folder.write("bus/usb-serial/devices/ttyUSB7/latency_timer", latency);
    std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  }
  [[nodiscard]] std::string ask() const {
    return ask_for_low_latency(-1, "/dev/ttyUSB7", folder.path());
  }
  test::TempFolder folder;
  std::filesystem::path timer;
};

TEST_CASE("an adapter that collects bytes is told not to, and the log says so") {
  const Adapter adapter("16\n");
  CHECK(adapter.ask() == "its USB adapter collected bytes for 16 ms, now for 1 ms");
  CHECK(test::file_text(adapter.timer).starts_with("1"));
  CHECK(adapter.ask().empty());
}

TEST_CASE("an adapter whose timer may not be set has it named, with the cure") {
  const Adapter adapter("16\n");
  std::filesystem::permissions(adapter.timer, std::filesystem::perms(0444));
  const test::AsNobody nobody;
  CHECK(adapter.ask() ==
        "its USB adapter collects bytes for 16 ms; `posed doctor` says how to change that");
  CHECK(test::file_text(adapter.timer) == "16\n");
}

TEST_CASE("a port without a latency timer has nothing said of it") {
  const test::TempFolder folder;
  CHECK(ask_for_low_latency(-1, "/dev/ttyACM0", folder.path()).empty());
  CHECK(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace posed::drivers
