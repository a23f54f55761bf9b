// The template glove: its line, byte by byte, and what its decoder makes of damage.
#include <catch2/catch.hpp>

#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/served_emulator.hpp"

namespace posed::drivers {
namespace {

const Driver& template_glove() { return *find_driver("template_glove"); }

void decode_template(std::string_view text, test::CollectSink& sink) {
  test::decoder_of(template_glove(), {})->feed(std::as_bytes(std::span(text)), 0, sink);
}

}  // namespace

TEST_CASE("a line of the template glove is as in its drawing") {
  test::CollectSink sink;
  decode_template("G 1023 512 0 87 1001 B 1 *3D\r\n", sink);
  CHECK(sink.count(Outcome::kOk) == 1);
  REQUIRE(sink.samples.size() == 1);
  const Sample& sample = sink.samples[0];
  CHECK(sample.value[0] == 1.0F);                    // thumb, as a share
  CHECK(sample.value[1] == Approx(512.0 / 1023.0));  // index
  CHECK(sample.value[5] == 1023.0F);                 // thumb, raw
  CHECK(sample.value[10] == 1.0F);                   // button
  REQUIRE(sink.frames.size() == 1);
  CHECK(hand_angles(sink.frames[0])[3] == Approx(60.0 * kDegree));  // the thumb's second joint
}

TEST_CASE("a damaged line of the template glove is counted as what it is") {
  test::CollectSink sink;
  decode_template("G 1023 512 0 87 1001 B 1 *00\n", sink);
  CHECK(sink.count(Outcome::kBadChecksum) == 1);
  decode_template("1023 512 0 87 1001\n", sink);
  CHECK(sink.count(Outcome::kForeign) == 1);
  decode_template("G 1024 0 0 0 0 B 0 *32\n", sink);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  CHECK(sink.frames.empty());
}

TEST_CASE("a template glove opens at its first line, and says what comes instead of one") {
  const auto emulator = template_glove().emulate({}).value();
  test::ServedEmulator served(*emulator);
  TransportFactory ports;
  const auto device = template_glove().open({{"port", served.port()}}, ports);
  if (!device) FAIL(device.error().text());
  CHECK(device->description.text == "template_glove hand=right");
  const auto other_emulator = find_driver("lucidgloves")->emulate({}).value();
  test::ServedEmulator other(*other_emulator);
  const auto refused = template_glove().open({{"port", other.port()}}, ports);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().text().find("no line of this glove") != std::string::npos);
}

}  // namespace posed::drivers
