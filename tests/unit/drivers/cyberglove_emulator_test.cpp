// The emulated CyberGlove: its replies, its motors, its faults.
#include <catch2/catch.hpp>

#include "drivers/glove/traits.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/cyberglove_rig.hpp"

namespace posed::drivers::cyberglove {

using test::CollectSink;

TEST_CASE("the emulated CyberGlove answers like the real one") {
  const auto emulator = emulator_of({.mask = kMask18});
  const auto ask = [&](std::string_view text) { return text_of(notify(*emulator, text)); };
  using namespace std::string_literals;
  CHECK(ask("?i").contains("CyberGlove"));
  CHECK(ask("?i").back() == '\0');
  CHECK(ask("?G") == "?G\x03\0"s);
  CHECK(ask("?S") == "?S\x12\0"s);
  CHECK(ask("?K") == "?K\x3F\xBB\x7B\0"s);
  CHECK(ask("?D") == "?D\0\0"s);
  CHECK(ask("?d") == "?d 0\r\n\0"s);
  CHECK(ask("?R") == "?R\1\0"s);
  CHECK(ask("D\1"s) == "D\0"s);
  CHECK(ask("?D") == "?D\1\0"s);
  CHECK(ask("d 0\r") == "d 0\0"s);
  CHECK(ask("?D") == "?D\0\0"s);
  CHECK(ask("t 1152 1\r") == "t 1152 1\0"s);
  CHECK(ask("?T") == "?T\x04\x80\x00\x01\0"s);
  CHECK(ask("?t") == "?t 1152 1\r\n\0"s);
  CHECK(ask("t x\r") == "en\0"s);
  CHECK(ask("\r\n").empty());
  CHECK(ask("^c") == " e?\r\n\0"s);
  CHECK(ask("X") == " e?\r\n\0"s);
  CHECK(ask("1S").starts_with(" e?"));  // not a CyberGlove III
  (void)ask("\x03");
  CHECK(emulator->next_due_ns() == kNoTime_ns);
  CHECK(ask("g").starts_with("g "));
  CHECK(ask("S").empty());
  CHECK(emulator->next_due_ns() == 10'000'000);
  CHECK(ask("^c") == " e?\r\n\0"s);  // the stop command has no effect
  CHECK(emulator->next_due_ns() == 10'000'000);
  CHECK(ask("\x03") == "\x03\0"s);
  CHECK(emulator->next_due_ns() == kNoTime_ns);
  CHECK(ask("\x12") == "\x12\r\n\0"s);
  CHECK(ask("?t") == "?t 1920 1\r\n\0"s);
  emulator->settings().plugged_in = false;
  CHECK(ask("?G") == "?G\x01\0"s);
  CHECK(ask("?U") == "?U\0\0"s);
  CHECK(ask("M\x01"s).empty());  // not complete yet
  CHECK(ask("\0\0"s) == "M\0"s);
  CHECK(ask("?M") == "?M\x01\0\0\0"s);
}

TEST_CASE("a CyberTouch vibrates the fingers with a force, and samples continue") {
  const auto bytes = find_driver("cyberglove")
                         ->glove->encode_haptics({}, {.force = {1.0F, -1.0F, 0.0F, -1.0F, 0.5F}});
  REQUIRE(bytes);
  CHECK(text_of(*bytes) == std::string("A\x03\x00\xFF\x02\x00\x04\x80", 8));
  const auto emulator = emulator_of({});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = kPlain22});
  (void)notify(*emulator, plain_start());
  CollectSink sink;
  decoder->feed(next(*emulator), 0, sink);
  decoder->feed(notify(*emulator, text_of(*bytes)), 0, sink);
  decoder->feed(next(*emulator), 0, sink);
  CHECK(sink.outcomes == std::array<int, kOutcomes>{2, 0, 0, 0, 0});
  CHECK(text_of(notify(*emulator, "?A")) == std::string("?A\xFF\0\0\0\x80\0\0", 9));
  const auto driver = *find_driver("cyberglove");
  CHECK_FALSE(driver.glove->encode_haptics({}, {.force = {2.0F}}));
  CHECK_FALSE(driver.glove->encode_haptics({}, {.vibration_s = 1.0F}));
}

TEST_CASE("a CyberGlove's sensor that is stuck stays where it is") {
  const auto emulator = emulator_of({.stuck_sensor = kIndexMcp, .stuck_at = 77});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = kPlain22});
  (void)notify(*emulator, plain_start());
  emulator->set_raw(some_raw());
  CollectSink sink;
  decoder->feed(next(*emulator), 0, sink);
  CHECK(sink.samples[0].value[kSensors + kIndexMcp] == 77.0F);
}

}  // namespace posed::drivers::cyberglove
