// LucidGloves: lines that real gloves sent, damaged lines, forces in both directions, and the glove
// on a port.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <numbers>

#include "drivers/driver.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/lucidgloves/decoder.hpp"
#include "drivers/lucidgloves/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/free_port.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/emulated.hpp"
#include "tests/unit/drivers/served_emulator.hpp"

namespace posed::drivers {
namespace {

using lucidgloves::Encoding;
using lucidgloves::Line;
using lucidgloves::LucidEmulator;
using test::CollectSink;
using test::decoder_of;

Outcome parse(std::string_view text, Line& line, int max = 4095) {
  return lucidgloves::parse_line(text, Encoding::kAuto, max, line);
}

Outcome outcome_of(std::string_view text, int max = 4095) {
  Line line;
  return parse(text, line, max);
}

void feed(Decoder& decoder, std::string_view text, Sink& sink) {
  decoder.feed(std::as_bytes(std::span(text)), 0, sink);
}

std::string haptics_text(const Options& options, const glove::Haptics& haptics) {
  const auto bytes = find_driver("lucidgloves")->glove->encode_haptics(options, haptics);
  if (!bytes) return "refused: " + bytes.error().message;
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

// A glove on the network, which connects to us and then sends.
class NetworkGlove {
 public:
  explicit NetworkGlove(std::uint16_t port)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in to = loopback(port);
    REQUIRE(::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  }
  ~NetworkGlove() { ::close(fd_); }
  NetworkGlove(const NetworkGlove&) = delete;
  NetworkGlove& operator=(const NetworkGlove&) = delete;

  void say(std::string_view text) const {
    REQUIRE(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  [[nodiscard]] std::string received() const {
    std::array<char, 256> text{};
    const ssize_t got = ::recv(fd_, text.data(), text.size(), 0);
    return {text.data(), static_cast<std::size_t>(got < 0 ? 0 : got)};
  }

  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

 private:
  int fd_;
};

}  // namespace

TEST_CASE("lines that real LucidGloves sent are read") {
  Line line;
  // As quoted by users: lucidgloves issue 36, and a glove with the old firmware.
  REQUIRE(parse("A1662B3329C1229D4095E4095F384G0ILM", line) == Outcome::kOk);
  CHECK(line.value[lucidgloves::kCurl + 0] == 1662);
  CHECK(line.value[lucidgloves::kCurl + 4] == 4095);
  CHECK(line.value[lucidgloves::kJoyX] == 384);
  CHECK(line.has[lucidgloves::kJoyY]);
  CHECK(line.pressed.to_string() == "00110010");  // I, L, M
  REQUIRE(parse("A2816B4037C3596D4095E1115F469G56ILM", line) == Outcome::kOk);
  CHECK(line.value[lucidgloves::kJoyY] == 56);
  // The firmware's own encoder with the index finger closed: the trigger is one above the range.
  REQUIRE(parse("A0B4095C0D0E0F2048G2048P4096", line) == Outcome::kOk);
  CHECK(line.value[lucidgloves::kTrigger] == 4095);
  REQUIRE(parse("511&511&511&511&511&232&164&0&0&0&0&0&0", line, 1023) == Outcome::kOk);
  CHECK(line.value[lucidgloves::kJoyX] == 232);
  CHECK(line.pressed.none());
}

TEST_CASE("joints, splay, keys in any order and keys that nobody knows") {
  Line line;
  REQUIRE(parse("O(EAD)7P9(BB)2048X55(QQ)3B1(AAB)12", line) == Outcome::kOk);
  CHECK(line.value[lucidgloves::kJoint + 4 * lucidgloves::kJoints + 3] == 7);
  CHECK(line.value[lucidgloves::kJoint + 1] == 12);
  CHECK(line.value[lucidgloves::kSplay + 1] == 2048);
  CHECK(line.value[lucidgloves::kTrigger] == 9);
  CHECK(line.pressed.to_string() == "10000000");
  CHECK(line.has.count() == 5);
  REQUIRE(parse("Z(ZV)5(ZG)0(ZH)1", line) == Outcome::kOk);
  CHECK(line.info == std::array{5, 0, 1});
  CHECK_FALSE(line.has_hand());
}

TEST_CASE("lines that no glove sends are classified") {
  CHECK(outcome_of("rst:0x1 (POWERON_RESET),boot:0x13") == Outcome::kForeign);
  CHECK(outcome_of("ets Jun  8 2016 00:22:57") == Outcome::kForeign);
  CHECK(outcome_of("62B3329C1229D4095E4095") == Outcome::kForeign);  // the beginning is missing
  CHECK(outcome_of("A1B2C3D4E5A1B2C3D4E5") ==
        Outcome::kForeign);  // two lines without a line end between them
  CHECK(outcome_of("A1B2C3D4EF5") == Outcome::kForeign);  // a curl without its value
  CHECK(outcome_of("A1B2(AAB") == Outcome::kForeign);
  CHECK(outcome_of("A1B2()5") == Outcome::kForeign);
  CHECK(outcome_of("A1B23329999999999999999999") == Outcome::kOutOfRange);
  CHECK(outcome_of("A1024", 1023) == Outcome::kOutOfRange);
  CHECK(outcome_of("A1P8191") == Outcome::kOutOfRange);
  CHECK(outcome_of("X5") == Outcome::kShort);
  CHECK(outcome_of("IL") == Outcome::kShort);
  CHECK(outcome_of("1&2&3") == Outcome::kShort);
  CHECK(outcome_of("1&2&3&4&5&6&7&0&0&0&0&0&2") == Outcome::kOutOfRange);
  CHECK(outcome_of("1&2&3&4&5&6&7&0&0&0&0&0&0&0") == Outcome::kForeign);
  CHECK(outcome_of("1&2&3&4&5&6&&0&0&0&0&0&0") == Outcome::kForeign);
}

TEST_CASE("a finger's curl replaces joints and splay that the glove lacks") {
  const auto decoder = decoder_of(*find_driver("lucidgloves"));
  CollectSink sink;
  feed(*decoder, "A0B4095C0D0E0(CAC)4095\r\n\r\n", sink);
  REQUIRE(sink.frames.size() == 1);
  CHECK(sink.count(Outcome::kOk) == 1);  // an empty line is not counted
  const HandAngles angles = hand_angles(sink.frames[0]);
  const double right_angle = std::acos(0.0);
  CHECK(angles[1 * kFingerChannels] == Approx(right_angle));
  CHECK(angles[1 * kFingerChannels + 3] == Approx(right_angle / 90.0 * 100.0));
  CHECK(angles[2 * kFingerChannels] == Approx(0.0).margin(1e-6));
  CHECK(angles[2 * kFingerChannels + 3] == Approx(right_angle / 90.0 * 100.0));
  CHECK(sink.frames[0].valid.count() == kHandSkeletonJoints);
  const auto layout = find_driver("lucidgloves")->expect({})->samples;
  const auto place = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(layout.names, name) - layout.names.begin());
  };
  const Sample& sample = sink.samples[0];
  CHECK(sample.valid[place("index_splay")]);
  CHECK_FALSE(sample.valid[place("raw_index_splay")]);
  CHECK_FALSE(sample.valid[place("joystick_x")]);
  CHECK_FALSE(sample.valid[place("firmware")]);
  CHECK(sample.value[place("raw_middle_joint2")] == 4095.0F);
}

TEST_CASE("a line that lacks a known finger is damaged, until the finger stays absent") {
  const auto decoder = decoder_of(*find_driver("lucidgloves"));
  CollectSink sink;
  feed(*decoder, "A1B2C3D4E5\n", sink);
  for (int i = 0; i < 7; ++i) feed(*decoder, "A1B2D4E5\n", sink);
  CHECK(sink.frames.size() == 1);
  CHECK(sink.count(Outcome::kShort) == 7);
  feed(*decoder, "A1B2D4E5\n", sink);
  REQUIRE(sink.frames.size() == 2);
  CHECK_FALSE(sink.frames[1].valid[static_cast<std::size_t>(hand_joint(2, 1))]);
}

TEST_CASE("a line longer than any glove's is discarded once, and its end is not read as a line") {
  const auto decoder = decoder_of(*find_driver("lucidgloves"));
  CollectSink sink;
  feed(*decoder, std::string(1000, 'A') + "A1B2C3D4E5\nA1B2C3D4E5\n", sink);
  CHECK(sink.count(Outcome::kForeign) == 1);
  CHECK(sink.frames.size() == 1);
}

TEST_CASE("an emulated LucidGlove's pose comes back within half a count") {
  for (const test::DeviceFixture& fixture : test::device_fixtures()) {
    if (fixture.driver != "lucidgloves") continue;
    INFO(fixture.name);
    const bool joints = fixture.name == "lucidgloves-alpha";
    const auto decoder = decoder_of(*find_driver("lucidgloves"), fixture.options);
    CollectSink sink;
    for (const auto& [due_ns, bytes] : test::emulated_chunks(fixture, 1)) {
      decoder->feed(bytes, due_ns, sink);
    }
    REQUIRE(sink.frames.size() == fixture.loop_chunks);
    double worst = 0.0;  // counts
    for (std::size_t i = 0; joints && i < sink.frames.size(); ++i) {
      const HandAngles sent = test::closing_hand(i, fixture.loop_chunks);
      const HandAngles got = hand_angles(sink.frames[i]);
      for (std::size_t c = 0; c < sent.size(); ++c) {
        // The largest count is a middle joint's: 100 degrees over the range.
        worst = std::max(worst, std::abs(sent[c] - got[c]) / (std::numbers::pi * 100.0 / 180.0));
      }
    }
    CHECK(worst * 4095.0 <= 0.51);
  }
}

TEST_CASE("forces and vibrations reach the glove as requested, and negative ones change nothing") {
  LucidEmulator glove({.hand = Side::kRight, .encoding = Encoding::kAuto, .max_analog = 4095});
  const auto notify = [&](const std::string& text) {
    Emulator::Bytes answer;
    glove.receive(std::as_bytes(std::span(text)), 0, answer);
  };
  notify(haptics_text({}, {.force = {0.0F, 0.5F, 1.0F, 0.25F, 0.75F}}));
  CHECK(glove.forces() == lucidgloves::Forces{0, 500, 1000, 250, 750});
  notify(haptics_text({}, {.force = {1.0F, -1.0F, -1.0F, -1.0F, 0.0F}}));
  CHECK(glove.forces() == lucidgloves::Forces{1000, 500, 1000, 250, 0});
  notify(haptics_text({{"force_range", std::int64_t{4095}}}, {.force = {1.0F, 0, 0, 0, 0}}));
  CHECK(glove.forces()[0] == 4095);
  const Options legacy{{"encoding", std::string("legacy")}};
  CHECK(haptics_text(legacy, {.force = {0.1F, 0, 0, 0, 1.0F}}) == "100&0&0&0&1000\n");
  notify(haptics_text(legacy, {.force = {0.1F, 0.2F, 0, -1.0F, 1.0F}}));
  CHECK(glove.forces() == lucidgloves::Forces{100, 200, 0, 0, 1000});
  const glove::Haptics buzz{
      .force = {-1, -1, -1, -1, -1}, .vibration_hz = 80.0F, .vibration_s = 0.1F, .vibration = 0.5F};
  CHECK(haptics_text({}, buzz) == "A-1B-1C-1D-1E-1\nF80.00G0.10H0.50\n");
  notify(haptics_text({}, buzz));
  CHECK(glove.vibration() == "F80.00G0.10H0.50");
  CHECK(glove.forces() == lucidgloves::Forces{100, 200, 0, 0, 1000});
  CHECK(haptics_text(legacy, buzz).starts_with("refused"));
  CHECK(haptics_text({}, {.force = {1.5F, 0, 0, 0, 0}}).starts_with("refused"));
  CHECK(haptics_text({}, {.force = {NAN, 0, 0, 0, 0}}).starts_with("refused"));
}

TEST_CASE("a LucidGlove on a port is opened, read and identified by hand and range") {
  LucidEmulator glove({.hand = Side::kLeft, .encoding = Encoding::kAlpha, .max_analog = 4095});
  const test::ServedEmulator served(glove);
  TransportFactory ports;
  const auto open = [&](const std::string& hand, std::int64_t max) {
    return find_driver("lucidgloves")
        ->open({{"port", served.port()}, {"hand", hand}, {"max_analog_value", max}}, ports);
  };
  {
    auto device = open("left", 4095);
    if (!device) FAIL(device.error().text());
    CHECK(device->description.text == "lucidgloves hand=left encoding=auto max=4095");
    CollectSink sink;
    REQUIRE(device->transport->start(0));
    for (int i = 0; i < 1000 && sink.frames.size() < 3; ++i) {
      pollfd ready{.fd = device->transport->poll_fd(), .events = POLLIN, .revents = 0};
      (void)::poll(&ready, 1, 10);
      device->decoder->feed(device->transport->read(0).bytes, 0, sink);
    }
    CHECK(sink.frames.size() >= 3);
    CHECK(sink.count(Outcome::kForeign) == 0);
  }
  const auto other = open("right", 4095);
  REQUIRE_FALSE(other);
  CHECK(other.error().message.find("left glove") != std::string::npos);
}

TEST_CASE("a LucidGlove that connects over TCP is read, its empty lines left out") {
  const std::uint16_t port = test::free_port();
  const Options options{{"link", std::string("tcp")},
                        {"listen", "127.0.0.1:" + std::to_string(port)}};
  TransportFactory ports;
  // no glove has connected yet; it continues to listen
  CHECK_FALSE(find_driver("lucidgloves")->open(options, ports));
  const NetworkGlove glove(port);
  glove.say("A1B2C3D4E5\n\r\nZ(ZV)5(ZG)0(ZH)1\n\r\n");
  auto device = find_driver("lucidgloves")->open(options, ports);
  if (!device) FAIL(device.error().text());
  CHECK(glove.received() == "(ZA)Z\n");
  CollectSink sink;
  REQUIRE(device->transport->start(0));
  glove.say("A1B2C3D4E5\n\r\nA2B2C3D4E5\n\r\n");
  for (int i = 0; i < 1000 && sink.frames.size() < 2; ++i) {
    pollfd ready{.fd = device->transport->poll_fd(), .events = POLLIN, .revents = 0};
    (void)::poll(&ready, 1, 10);
    device->decoder->feed(device->transport->read(0).bytes, 0, sink);
  }
  CHECK(sink.frames.size() == 2);
  CHECK(sink.outcomes == std::array<int, kOutcomes>{2});
  REQUIRE(device->transport->send(std::as_bytes(std::span(std::string_view("A0B0C0D0E0\n")))));
  CHECK(glove.received() == "A0B0C0D0E0\n");
}

TEST_CASE("a port with another device on it is refused with what to check") {
  test::PseudoTerminal port;
  TransportFactory ports;
  const auto device = find_driver("lucidgloves")->open({{"port", port.port()}}, ports);
  REQUIRE_FALSE(device);
  CHECK(device.error().message.find("sends nothing") != std::string::npos);
  LucidEmulator glove({.hand = Side::kRight, .encoding = Encoding::kAlpha, .max_analog = 4095});
  const test::ServedEmulator served(glove);
  const auto coarse =
      find_driver("lucidgloves")
          ->open({{"port", served.port()}, {"max_analog_value", std::int64_t{1023}}}, ports);
  REQUIRE_FALSE(coarse);
  CHECK(coarse.error().message.find("4095") != std::string::npos);
}

}  // namespace posed::drivers
