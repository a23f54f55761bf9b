// Gloves on hidraw: found by hidapi, read from the node, unplugged and found again.
#include <catch2/catch.hpp>

#include <poll.h>

#include <algorithm>

#include "drivers/driver.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/hotplug_monitor.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/usb/gloves.hpp"
#include "tests/usb/speaker.hpp"

namespace posed::test {
namespace {

using drivers::Chunk;
using drivers::Device;
using drivers::Driver;
using drivers::Options;
using drivers::TransportFactory;

constexpr int kPatience_ms = 5000;

// Like the reader thread: waits for the descriptor, then reads.
Chunk next_report(drivers::Transport& transport) {
  pollfd wanted{.fd = transport.poll_fd(), .events = POLLIN, .revents = 0};
  REQUIRE(::poll(&wanted, 1, kPatience_ms) == 1);
  return transport.read(0);
}

std::vector<std::byte> report_of(std::uint8_t n) {
  std::vector<std::byte> report(64);
  for (std::size_t i = 0; i < report.size(); ++i) report[i] = static_cast<std::byte>(n + i);
  return report;
}

// Reads `count` reports and checks that each is as it was sent, none is missing, and the decoded
// values equal those of the same bytes decoded without a device.
void check_stream(Device& device, const Driver& driver, const Speaker& speaker, std::size_t count) {
  REQUIRE(device.transport->start(0));
  CollectSink live, again;
  std::vector<Speaker::Report> got;
  while (got.size() < count) {
    const Chunk chunk = next_report(*device.transport);
    REQUIRE_FALSE(chunk.lost);
    got.emplace_back(chunk.bytes.begin(), chunk.bytes.end());
    device.decoder->feed(chunk.bytes, 0, live);
  }
  const auto said = speaker.said();
  const auto from = std::ranges::find(said, got.front());
  REQUIRE(said.end() - from >= std::ssize(got));
  CHECK(std::equal(got.begin(), got.end(), from));
  CHECK(live.count(Outcome::kOk) == static_cast<int>(count));
  REQUIRE(live.samples.size() == count);
  const auto decoder = driver.make_decoder(device.description);
  REQUIRE(decoder);
  for (const auto& report : got) (*decoder)->feed(report, 0, again);
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(is_valid(live.samples[i]));
    CHECK(same_values(live.samples[i], again.samples[i]));
  }
  CHECK_FALSE(same_values(live.samples.front(), live.samples.back()));  // the hand moves
}

void check_driver(const std::string& name, const Options& options, HidGlove& glove,
                  const std::string& identity) {
  const Driver* const driver = drivers::find_driver(name);
  REQUIRE(driver != nullptr);
  auto emulator = driver->emulate(options);
  REQUIRE(emulator);
  const Speaker speaker(glove, std::move(*emulator));
  TransportFactory ports;
  for (int round = 0; round < 3; ++round) {
    glove.plug();
    auto device = driver->open(options, ports);
    if (!device) FAIL(device.error().message);
    CHECK(device->description.identity == identity);
    check_stream(*device, *driver, speaker, 40);
    glove.unplug();
    while (!next_report(*device->transport).lost) continue;
    CHECK_FALSE(driver->open(options, ports));
  }
}

}  // namespace

TEST_CASE("a hidraw node gives one report per read, until the glove is unplugged") {
  Bench bench;
  HidGlove glove(bench, kUltra), other(bench, kMine);
  glove.plug();
  other.plug();
  TransportFactory ports;
  auto link = ports.hid({.vendor = kUltra.vendor});
  REQUIRE(link);
  CHECK(link->name() == glove.node());
  CHECK(link->identity() == "5d70:0001 ULTRA-7");
  const auto transport = drivers::make_link_transport(std::move(*link));
  REQUIRE(transport->start(0));
  CHECK(transport->read(0).bytes.empty());  // nothing was sent
  for (int n = 0; n < 256; ++n) {
    const auto report = report_of(static_cast<std::uint8_t>(n));
    REQUIRE(glove.say(report));
    REQUIRE(std::ranges::equal(next_report(*transport).bytes, report));
  }
  const auto reported = report_of(7);
  CHECK(transport->send(reported));
  CHECK(glove.received() == reported);
  glove.unplug();
  CHECK(next_report(*transport).lost);
  const auto gone = ports.hid({.vendor = kUltra.vendor});
  REQUIRE_FALSE(gone);
  CHECK(gone.error().message.find("no HID node") != std::string::npos);
}

TEST_CASE("a replugged glove is reported, and found by its identity on its new node") {
  Bench bench;
  HidGlove glove(bench, kUltra);
  drivers::HotplugMonitor arrivals;
  TransportFactory ports;
  for (const std::string id : {"", "ULTRA-7", "1-2", "1-2:1.0", "5d70:0001 ULTRA-7"}) {
    INFO(id);
    const std::string before = glove.node();
    arrivals.consume();
    glove.plug();
    CHECK(arrivals.consume());
    CHECK(glove.node() != before);
    const auto link = ports.hid({.vendor = kUltra.vendor, .id = id});
    REQUIRE(link);
    CHECK(link->name() == glove.node());
    const auto again = ports.hid({.vendor = kUltra.vendor, .id = id});
    REQUIRE_FALSE(again);
    CHECK(again.error().message.find("in use") != std::string::npos);
    glove.unplug();
  }
  glove.plug();
  const auto by_path = ports.hid({.path = glove.node()});
  REQUIRE(by_path);
  CHECK(by_path->identity() == "5d70:0001 ULTRA-7");
  CHECK_FALSE(ports.hid({.vendor = kUltra.vendor, .id = "ULTRA-8"}));
}

TEST_CASE("the 5DT driver opens an Ultra USB, decodes it, loses it and opens it again") {
  Bench bench;
  HidGlove glove(bench, kUltra);
  check_driver("fivedt", {{"model", std::string("ultra-usb-14")}, {"hand", std::string("left")}},
               glove, "5d70:0001 ULTRA-7");
}

TEST_CASE("a HID glove with only a description is opened, started and decoded") {
  const TempFolder folder;
  const auto description = folder.write("mine.toml", readme_description());
  Bench bench;
  HidGlove glove(bench, kMine);
  check_driver("described", {{"device", description.string()}}, glove, "1234:abcd MINE-1");
}

}  // namespace posed::test
