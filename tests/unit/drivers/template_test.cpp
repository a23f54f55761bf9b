// The template device: its packet, byte by byte, and its decoder's handling of damage.
#include <catch2/catch.hpp>

#include <numbers>

#include "drivers/driver.hpp"
#include "drivers/template/protocol.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::drivers {
namespace {

using bend::encode_packet;
using Bytes = std::vector<std::byte>;

Bytes packets(int first, int count) {
  Bytes bytes;
  for (int i = first; i < first + count; ++i) {
    const auto packet = encode_packet({.count = static_cast<std::uint8_t>(i), .bend_rad = 0.5F});
    bytes.insert(bytes.end(), packet.begin(), packet.end());
  }
  return bytes;
}

void decode(const Bytes& bytes, test::CollectSink& sink) {
  const Driver* driver = find_driver("template");
  REQUIRE(driver != nullptr);
  const auto description = driver->describe("BEND1 rate=100", "test");
  REQUIRE(description);
  const auto decoder = driver->make_decoder(*description);
  REQUIRE(decoder);
  (*decoder)->feed(bytes, 0, sink);
}

}  // namespace

TEST_CASE("a bend packet has the bytes of its drawing") {
  const float bend_rad = 45.0F * std::numbers::pi_v<float> / 180.0F;
  const auto bytes = encode_packet({.count = 7, .bend_rad = bend_rad, .battery = 0.5F});
  CHECK(bytes == std::array{std::byte{0xA5}, std::byte{7}, std::byte{0x94}, std::byte{0x11},
                            std::byte{50}, std::byte{(0xA5 + 7 + 0x94 + 0x11 + 50) & 0xFF}});
  test::CollectSink sink;
  decode({bytes.begin(), bytes.end()}, sink);
  REQUIRE(sink.frames.size() == 1);
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.frames[0].rotation_xyzw[1][2] == Approx(std::sin(bend_rad / 2)));
  CHECK(sink.frames[0].angle_rad[0] == Approx(bend_rad));
  CHECK(sink.samples[0].value[1] == 0.5F);
}

TEST_CASE("the packet counter is the device's clock: lost packets leave a gap in time") {
  Bytes bytes = packets(254, 1);
  const Bytes later = packets(254 + 5, 1);
  bytes.insert(bytes.end(), later.begin(), later.end());
  test::CollectSink sink;
  decode(bytes, sink);
  REQUIRE(sink.frames.size() == 2);
  CHECK(sink.frames[0].header.device_ns == 0);
  CHECK(sink.frames[1].header.device_ns == 50'000'000);
}

TEST_CASE("damaged packets are counted and only they are lost") {
  Bytes bytes = packets(0, 10);
  bytes[3 * 6 + 2] ^= std::byte{0x40};                                // bend of packet 3
  bytes.insert(bytes.begin() + 6 * 6, {std::byte{1}, std::byte{2}});  // noise before packet 6
  bytes.erase(bytes.begin() + 8 * 6 + 2 + 1);                         // a byte of packet 8 lost
  test::CollectSink sink;
  decode(bytes, sink);
  CHECK(sink.frames.size() == 8);
  CHECK(sink.count(Outcome::kOk) == 8);
  CHECK(sink.count(Outcome::kBadChecksum) == 2);
  CHECK(sink.count(Outcome::kForeign) >= 1);
  CHECK(sink.frames.back().header.device_ns == 90'000'000);
}

TEST_CASE("a bend that no finger makes is out of range, and the stream continues") {
  const auto wild = encode_packet({.count = 0, .bend_rad = 3.1F});
  Bytes bytes(wild.begin(), wild.end());
  const Bytes good = packets(1, 1);
  bytes.insert(bytes.end(), good.begin(), good.end());
  test::CollectSink sink;
  decode(bytes, sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  CHECK(sink.frames.size() == 1);
}

TEST_CASE("another device's device info is refused by name") {
  const Driver* driver = find_driver("template");
  for (const char* text : {"", "BEND1", "BEND1 rate=", "BEND1 rate=0", "BEND1 rate=nan",
                           "BEND1 rate=100x", "HIERARCHY"}) {
    const auto description = driver->describe(text, "port-1");
    REQUIRE_FALSE(description);
    CHECK(description.error().text().starts_with("port-1: does not greet as a bend sensor"));
  }
}

}  // namespace posed::drivers
