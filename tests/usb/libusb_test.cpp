// A P5 through libusb: feature reports, a stream of reports, and unplugging.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <thread>

#include "drivers/driver.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/p5/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/emulated.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/p5_glove.hpp"

namespace posed::test {
namespace {

using drivers::Chunk;
using drivers::Transport;
using drivers::TransportFactory;

constexpr int kGloveInterface = 1;
constexpr std::chrono::seconds kPatience{5};

template <std::size_t kSize>
P5Glove::Bytes all(const std::array<std::byte, kSize>& bytes) {
  return {bytes.begin(), bytes.end()};
}

std::map<std::uint8_t, P5Glove::Bytes> p5_features() {
  using namespace drivers::p5;
  return {{kHeadsReport, all(emulated_heads())},
          {kFirmwareReport, all(emulated_firmware())},
          {kLedsReport, all(emulated_leds())}};
}

// umockdev's usbfs node is a file, which epoll cannot wait for, so this polls.
Chunk next_polled(Transport& transport) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    const Chunk chunk = transport.read(0);
    if (!chunk.bytes.empty() || chunk.lost) return chunk;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  FAIL("nothing came");
  return {};
}

drivers::UsbSettings p5_settings() {
  return {.vendor = kP5.vendor, .product = kP5.product, .interface = kGloveInterface};
}

bool mentions(const Error& error, const std::string& text) {
  return error.message.find(text) != std::string::npos;
}

}  // namespace

TEST_CASE("feature reports go to and from a USB device, and a missing one is an error") {
  Bench bench;
  P5Glove glove(bench, kP5, p5_features());
  glove.plug();
  TransportFactory ports;
  {
    auto link = ports.usb(p5_settings());
    if (!link) FAIL(link.error().message);
    CHECK(link->name() == glove.node());
    CHECK(link->identity() == "0d7f:0100 1-3");
    CHECK(glove.is_claimed());
    const auto firmware = link->feature(drivers::p5::kFirmwareReport, 3);
    REQUIRE(firmware);
    CHECK(*firmware == all(drivers::p5::emulated_firmware()));
    const auto leds = link->feature(drivers::p5::kLedsReport, 62);
    REQUIRE(leds);
    CHECK(*leds == all(drivers::p5::emulated_leds()));
    const P5Glove::Bytes reported{std::byte{1}, std::byte{2}, std::byte{3}};
    CHECK(link->set_feature(reported));
    CHECK(glove.last_set() == reported);
    const auto missing = link->feature(200, 8);
    REQUIRE_FALSE(missing);
    CHECK(mentions(missing.error(), "feature report 200"));
    const auto twice = ports.usb(p5_settings());
    REQUIRE_FALSE(twice);
    CHECK(mentions(twice.error(), "in use"));
  }
  CHECK_FALSE(glove.is_claimed());
  CHECK(ports.usb(p5_settings()));
}

TEST_CASE("reports of a USB device come in order, one per read, until it is unplugged") {
  Bench bench;
  P5Glove glove(bench, kP5, p5_features());
  TransportFactory ports;
  for (int round = 0; round < 3; ++round) {
    glove.plug();
    auto link = ports.usb(p5_settings());
    if (!link) FAIL(link.error().message);
    const auto transport = drivers::make_usb_transport(std::move(*link));
    REQUIRE(transport->start(0));
    for (int n = 0; n < 100; ++n) {
      // Sometimes more reports at once than there are transfers.
      const int burst = n % 10 == 0 ? 40 : 1;
      for (int i = 0; i < burst; ++i) {
        glove.say(P5Glove::Bytes(24, static_cast<std::byte>(n + i)));
      }
      for (int i = 0; i < burst; ++i) {
        const Chunk chunk = next_polled(*transport);
        REQUIRE(std::ranges::equal(chunk.bytes, P5Glove::Bytes(24, static_cast<std::byte>(n + i))));
      }
    }
    glove.unplug();
    CHECK(next_polled(*transport).lost);
    const auto gone = ports.usb(p5_settings());
    REQUIRE_FALSE(gone);
    CHECK(mentions(gone.error(), "no USB device"));
  }
}

TEST_CASE("the P5 driver reads heads, LEDs and reports from libusb") {
  Bench bench;
  P5Glove glove(bench, kP5, p5_features());
  glove.plug();
  const drivers::Driver* const driver = drivers::find_driver("p5");
  REQUIRE(driver != nullptr);
  TransportFactory ports;
  auto device = driver->open({{"id", std::string("1-3")}}, ports);
  if (!device) FAIL(device.error().message);
  CHECK(device->warnings.empty());
  CHECK(device->description.identity == "0d7f:0100 1-3");
  REQUIRE(device->transport->start(0));
  drivers::p5::P5Emulator emulator;
  CollectSink live, again;
  const auto decoder = driver->make_decoder(device->description);
  REQUIRE(decoder);
  for (std::size_t i = 0; i < 50; ++i) {
    emulator.pose(0, drivers::glove::hand_frame(closing_hand(i, 50)));
    P5Glove::Bytes report;
    emulator.emit(emulator.next_due_ns(), report);
    glove.say(report);
    device->decoder->feed(next_polled(*device->transport).bytes, 0, live);
    (*decoder)->feed(report, 0, again);
  }
  CHECK(live.count(Outcome::kOk) == 50);
  REQUIRE(live.frames.size() == 50);
  for (std::size_t i = 0; i < live.frames.size(); ++i) {
    CHECK(is_valid(live.frames[i]));
    CHECK(same_pose(live.frames[i], again.frames[i]));
  }
  CHECK_FALSE(same_pose(live.frames.front(), live.frames[25]));
}

TEST_CASE("a P5 without feature reports still gives finger bends, with a warning") {
  Bench bench;
  P5Glove glove(bench, kP5, {});
  glove.plug();
  TransportFactory ports;
  const auto device = drivers::find_driver("p5")->open({}, ports);
  if (!device) FAIL(device.error().message);
  CHECK(device->warnings.size() == 3);
}

}  // namespace posed::test
