// 5DT gloves: packets as in the published sources, damaged packets, and gloves on a port.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/driver.hpp"
#include "drivers/fivedt/decoder.hpp"
#include "drivers/fivedt/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/emulated.hpp"
#include "tests/unit/drivers/served_emulator.hpp"

namespace posed::drivers {
namespace {

using fivedt::FiveDtEmulator;
using fivedt::Reading;
using test::Bytes;
using test::CollectSink;
using test::decoder_of;

Bytes bytes_of(std::initializer_list<int> numbers) {
  Bytes bytes;
  for (const int number : numbers) bytes.push_back(static_cast<std::byte>(number));
  return bytes;
}

Reading decoded(fivedt::Form form, const Bytes& bytes) {
  Reading reading;
  REQUIRE(fivedt::packet_length(form, bytes) == bytes.size());
  REQUIRE(fivedt::decode_packet(form, bytes, reading) == Outcome::kOk);
  return reading;
}

// Largest error of a channel [rad] after the fixture's emulator and decoder.
double worst_error(const test::DeviceFixture& fixture, std::size_t joints) {
  const auto decoder = decoder_of(*find_driver("fivedt"), fixture.options);
  CollectSink sink;
  for (const auto& [due_ns, bytes] : test::emulated_chunks(fixture, 1)) {
    decoder->feed(bytes, due_ns, sink);
  }
  REQUIRE(sink.frames.size() == fixture.loop_chunks);
  double worst = 0.0;
  for (std::size_t i = 0; i < sink.frames.size(); ++i) {
    const HandAngles sent = test::closing_hand(i, fixture.loop_chunks);
    const HandAngles got = hand_angles(sink.frames[i]);
    for (std::size_t f = 1; f < kFingers; ++f) {
      for (std::size_t j = 0; j < joints; ++j) {
        const std::size_t c = f * kFingerChannels + 3 * j;
        worst = std::max(worst, std::abs(sent[c] - got[c]));
      }
    }
  }
  return worst;
}

const test::DeviceFixture& fixture(const std::string& name) {
  const auto at = std::ranges::find(test::device_fixtures(), name, &test::DeviceFixture::name);
  REQUIRE(at != test::device_fixtures().end());
  return *at;
}

}  // namespace

TEST_CASE("a Data Glove 5's packet is XOR checked, and its start may be data, too") {
  const Bytes packet = bytes_of({0x80, 0x80, 1, 2, 3, 0xFF, 0x80, 0, 0xFF});
  const Reading reading = decoded(fivedt::Form::kFive, packet);
  CHECK(reading.value[0] == 0x80);
  CHECK(reading.value[4] == 0xFF);
  CHECK(reading.pitch == 0x80);
  // One byte changes. With the hand still, every byte 80 looks like a start; only the position
  // shows which one is.
  const auto decoder = decoder_of(*find_driver("fivedt"));
  CollectSink sink;
  Bytes damaged = packet;
  damaged[3] = std::byte{9};
  for (const Bytes& bytes : {packet, damaged, packet, packet}) decoder->feed(bytes, 0, sink);
  CHECK(sink.count(Outcome::kBadChecksum) == 1);
  REQUIRE(sink.samples.size() == 3);
  for (const Sample& sample : sink.samples) {
    CHECK(sample.value[5] == 128.0F);                                     // raw thumb
    CHECK(sample.value[10] == Approx(std::numbers::pi * 128.0 / 255.0));  // pitch
  }
}

TEST_CASE("a Data Glove 5's stream that begins in a packet's middle is found") {
  const Bytes packet = bytes_of({0x80, 10, 20, 30, 40, 50, 60, 70, 0});
  Bytes good = packet;
  for (std::size_t i = 1; i < 8; ++i) good[8] ^= good[i];
  const auto decoder = decoder_of(*find_driver("fivedt"));
  CollectSink sink;
  decoder->feed(std::span(good).subspan(4), 0, sink);
  for (int i = 0; i < 4; ++i) decoder->feed(good, 0, sink);
  CHECK(sink.frames.size() == 4);
  CHECK(sink.count(Outcome::kForeign) == 1);
}

TEST_CASE("one byte may follow a Data Glove 5's packet: ready if wired, the hand if not") {
  const Bytes packet = bytes_of({0x80, 1, 2, 3, 4, 5, 6, 7, 0});
  const auto outcomes = [&](const std::string& model, int tail) {
    const auto decoder = decoder_of(*find_driver("fivedt"), {{"model", model}});
    CollectSink sink;
    for (int i = 0; i < 3; ++i) {
      decoder->feed(packet, 0, sink);
      decoder->feed(bytes_of({tail}), 0, sink);
    }
    CHECK(sink.frames.size() == 3);
    return sink.count(Outcome::kForeign);
  };
  CHECK(outcomes("5", 0x55) == 0);
  CHECK(outcomes("5", 0x40) == 3);
  for (const int hand : {0x00, 0x01, 0x06, 0x40}) CHECK(outcomes("5-wireless", hand) == 0);
  CHECK(outcomes("5-wireless", 0x02) == 3);
}

TEST_CASE("a Data Glove 16's data and info packets follow each other as they like") {
  const std::vector<std::byte> info =
      fivedt::encode_packet(fivedt::Form::kSixteen, {.kind = Reading::Kind::kInfo}, Side::kRight);
  Reading sent;
  for (std::size_t i = 0; i < 16; ++i) sent.value[i] = static_cast<std::uint16_t>(4095 - 200 * i);
  const Bytes data = fivedt::encode_packet(fivedt::Form::kSixteen, sent, Side::kRight);
  CHECK(data.size() == 36);
  CHECK(decoded(fivedt::Form::kSixteen, data).value == sent.value);
  CHECK(decoded(fivedt::Form::kSixteen, info).kind == Reading::Kind::kInfo);
  const auto decoder = decoder_of(*find_driver("fivedt"), {{"model", std::string("16")}});
  CollectSink sink;
  for (const Bytes& bytes : {info, data, info, info, data}) decoder->feed(bytes, 0, sink);
  CHECK(sink.frames.size() == 2);
  CHECK(sink.count(Outcome::kOk) == 2);
  CHECK(sink.samples[1].value[16 + 15] == static_cast<float>(sent.value[15]));  // raw wrist
}

TEST_CASE("an Ultra Wireless record holds fourteen values of twelve bits, of either port") {
  Reading sent{.port_b = true};
  for (std::size_t i = 0; i < 14; ++i)
    sent.value[i] = static_cast<std::uint16_t>(0x123 + 0x111 * i);
  const Bytes record = fivedt::encode_packet(fivedt::Form::kUltraWireless, sent, Side::kRight);
  REQUIRE(record.size() == 29);
  CHECK(record[3] == std::byte{0x12});
  CHECK(record[4] == std::byte{0x32});
  CHECK(record[5] == std::byte{0x34});
  const Reading got = decoded(fivedt::Form::kUltraWireless, record);
  CHECK(got.value == sent.value);
  CHECK(got.port_b);
  const Bytes other =
      fivedt::encode_packet(fivedt::Form::kUltraWireless, {.value = sent.value}, Side::kRight);
  const auto decoder = decoder_of(*find_driver("fivedt"), {{"model", std::string("ultra-wireless")},
                                                           {"kit_port", std::string("b")}});
  CollectSink sink;
  for (int i = 0; i < 3; ++i) {
    decoder->feed(record, 0, sink);
    decoder->feed(other, 0, sink);
  }
  CHECK(sink.frames.size() == 3);
  CHECK(sink.count(Outcome::kOk) == 6);
}

TEST_CASE("an Ultra Wireless record after damage is found by the next one's start") {
  const auto decoder =
      decoder_of(*find_driver("fivedt"), {{"model", std::string("ultra-wireless")}});
  Reading reading;
  reading.value.fill(0x3C3);  // its start byte also occurs in the data
  const Bytes record = fivedt::encode_packet(fivedt::Form::kUltraWireless, reading, Side::kRight);
  CollectSink sink;
  decoder->feed(record, 0, sink);
  decoder->feed(std::span(record).subspan(10), 0, sink);
  sink.clear();
  for (int i = 0; i < 10; ++i) decoder->feed(record, 0, sink);
  CHECK(sink.frames.size() >= 8);
  for (const Sample& sample : sink.samples) CHECK(sample.value[14] == 963.0F);  // raw thumb near
}

TEST_CASE("a USB glove with five sensors has every third value") {
  Reading sent;
  for (std::size_t i = 0; i < 16; ++i) sent.value[i] = static_cast<std::uint16_t>(1500 + 100 * i);
  const Bytes report = fivedt::encode_packet(fivedt::Form::kUltraUsb5, sent, Side::kRight);
  REQUIRE(report.size() == 64);
  const auto decoder = decoder_of(*find_driver("fivedt"), {{"model", std::string("ultra-usb-5")}});
  CollectSink sink;
  decoder->feed(report, 0, sink);
  REQUIRE(sink.samples.size() == 1);
  for (std::size_t f = 0; f < kFingers; ++f) {
    CHECK(sink.samples[0].value[5 + f] == 1500.0F + 300.0F * static_cast<float>(f));
    CHECK(sink.samples[0].value[f] == Approx(0.2 * static_cast<double>(f)));
  }
}

TEST_CASE("emulated 5DT gloves' poses come back as exactly as their sensors allow") {
  // Half a count of the 1500 of a full bend; joints that one sensor cannot distinguish are left
  // out.
  CHECK(worst_error(fixture("fivedt-16"), 1) <= 0.51 * std::numbers::pi / 2.0 / 1500.0);
  CHECK(worst_error(fixture("fivedt-ultra-wireless"), 1) <= 0.51 * std::numbers::pi / 2.0 / 1500.0);
  CHECK(worst_error(fixture("fivedt-ultra-usb-14"), 1) <= 0.51 * std::numbers::pi / 2.0 / 1500.0);
  // One sensor a finger: the mean of its joints is right, each single joint is only near.
  CHECK(worst_error(fixture("fivedt-5"), 3) < 0.25);
  CHECK(worst_error(fixture("fivedt-ultra-usb-5"), 3) < 0.25);
}

TEST_CASE("a Data Glove 5 is asked who it is, then streams or is polled") {
  FiveDtEmulator glove({.hand = Side::kRight, .form = fivedt::Form::kFive});
  const test::ServedEmulator served(glove);
  TransportFactory ports;
  const auto other =
      find_driver("fivedt")->open({{"port", served.port()}, {"hand", std::string("left")}}, ports);
  REQUIRE_FALSE(other);
  CHECK(other.error().message.find("right glove") != std::string::npos);

  const auto polled =
      find_driver("fivedt")->open({{"port", served.port()}, {"poll_hz", std::int64_t{100}}}, ports);
  if (!polled) FAIL(polled.error().text());
  CHECK(polled->poll.period_ns == 10'000'000);
  CollectSink sink;
  REQUIRE(polled->transport->start(0));
  const auto wait = [&](std::size_t samples) {
    for (int i = 0; i < 1000 && sink.samples.size() < samples; ++i) {
      pollfd ready{.fd = polled->transport->poll_fd(), .events = POLLIN, .revents = 0};
      (void)::poll(&ready, 1, 10);
      polled->decoder->feed(polled->transport->read(0).bytes, 0, sink);
    }
    REQUIRE(sink.samples.size() == samples);
  };
  for (std::size_t i = 1; i <= 3; ++i) {
    REQUIRE(polled->transport->send(polled->poll.request));
    wait(i);
  }
  CHECK(sink.samples[0].quality == Quality::kMeasured);
  CHECK(sink.samples[1].quality == Quality::kHeld);  // the hand does not move
  CHECK(sink.samples[2].quality == Quality::kHeld);
}

TEST_CASE("a 5DT glove that only sends is identified by its packets") {
  FiveDtEmulator glove({.hand = Side::kLeft, .form = fivedt::Form::kFiveWireless});
  const test::ServedEmulator served(glove);
  TransportFactory ports;
  const auto open = [&](const std::string& model, const std::string& hand) {
    return find_driver("fivedt")->open({{"port", served.port()}, {"model", model}, {"hand", hand}},
                                       ports);
  };
  const auto left = open("5-wireless", "left");
  if (!left) FAIL(left.error().text());
  CHECK(left->warnings.empty());
}

TEST_CASE("a 5DT glove of another hand or model is refused with an error message") {
  FiveDtEmulator glove({.hand = Side::kLeft, .form = fivedt::Form::kFiveWireless});
  const test::ServedEmulator served(glove);
  TransportFactory ports;
  const auto open = [&](const std::string& model, const std::string& hand) {
    return find_driver("fivedt")->open({{"port", served.port()}, {"model", model}, {"hand", hand}},
                                       ports);
  };
  const auto sixteen = open("16", "right");
  REQUIRE_FALSE(sixteen);
  CHECK(sixteen.error().message.find("not of this model") != std::string::npos);
  const auto wired = open("5", "left");
  REQUIRE_FALSE(wired);
  CHECK(wired.error().message.find("5-wireless") != std::string::npos);
  const auto right = open("5-wireless", "right");
  if (!right) FAIL(right.error().text());
  REQUIRE(right->warnings.size() == 1);
  CHECK(right->warnings[0].find("left") != std::string::npos);
}

TEST_CASE("5DT options that do not fit each other are refused") {
  CHECK_FALSE(find_driver("fivedt")->expect({{"model", std::string("7")}}));
  CHECK_FALSE(
      find_driver("fivedt")->expect({{"model", std::string("16")}, {"poll_hz", std::int64_t{50}}}));
  CHECK_FALSE(find_driver("fivedt")->expect({{"poll_hz", std::int64_t{-1}}}));
  CHECK_FALSE(find_driver("fivedt")->expect({{"kit_port", std::string("c")}}));
}

}  // namespace posed::drivers
