// The template mocap system: its datagrams, byte by byte, its layouts, bodies that come and go, and
// its decoder's handling of damage.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <fstream>
#include <random>

#include "drivers/driver.hpp"
#include "drivers/template_mocap/emulator.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/recorded_log.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers::mocap {
namespace {

using mocap::BodyEntry;
using mocap::BodyPose;
using mocap::FramePacket;
using mocap::MocapEmulator;
using test::CollectSink;
using Bytes = std::vector<std::byte>;
using Layout = std::unique_ptr<const SourceLayout>;

// Two bodies of one joint and of two.
std::vector<BodyEntry> two_bodies() {
  return {{.id = 5, .name = "Ann", .joints = {{"hips", -1, {}}}},
          {.id = 300, .name = "Bo", .joints = {{"hips", -1, {}}, {"head", 0, {0, 0.5F, 0}}}}};
}

Bytes content_of(const Bytes& datagram) { return {datagram.begin() + 8, datagram.end() - 4}; }

Result<Layout> layout_of(const std::vector<BodyEntry>& bodies) {
  return find_driver("template_mocap")->make_layout(content_of(mocap::encode_description(bodies)));
}

BodyPose still(std::uint16_t id, std::size_t joints) {
  return {.id = id, .root_m = {1, 2, 3}, .rotation_xyzw = std::vector<Quatf>(joints, kIdentity)};
}

// A decoder that knows two_bodies(), and what it makes of frames.
struct Rig : test::DecoderRig {
  Rig() : DecoderRig("template_mocap") { use(content_of(mocap::encode_description(two_bodies()))); }

  std::uint32_t number = 0;

  void send(std::vector<BodyPose> bodies) {
    ++number;
    feed(mocap::encode_frame({number, number * 10'000, std::move(bodies)}));
  }
};

// The emulator's next datagram.
Bytes next(MocapEmulator& emulator) {
  Bytes bytes;
  emulator.emit(emulator.next_due_ns(), bytes);
  return bytes;
}

struct Session : test::DecoderRig {
  Session() : DecoderRig("template_mocap") {}

  void step(MocapEmulator& emulator) { feed(next(emulator)); }
};

}  // namespace

TEST_CASE("a mocap frame has the bytes of its drawing") {
  const FramePacket packet{
      .number = 0x01020304,
      .time_us = 0x0A0B0C0D,
      .bodies = {{.id = 5, .root_m = {1, 0, -2}, .rotation_xyzw = {kIdentity}}}};
  const Bytes bytes = mocap::encode_frame(packet);
  const std::array<unsigned, 48> expected{'M',  'C',  'A',  'P',  3, 0, 40, 0,    4, 3, 2,    1,
                                          0x0D, 0x0C, 0x0B, 0x0A, 1, 5, 0,  1,    0, 0, 0x80, 0x3F,
                                          0,    0,    0,    0,    0, 0, 0,  0xC0, 0, 0, 0,    0,
                                          0,    0,    0,    0,    0, 0, 0,  0,    0, 0, 0x80, 0x3F};
  REQUIRE(bytes.size() == expected.size() + 4);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(std::to_integer<unsigned>(bytes[i]) == expected[i]);
  }
  Rig rig;
  rig.decoder->feed(bytes, 0, rig.sink);
  REQUIRE(rig.sink.frames.size() == 1);
  CHECK(rig.sink.bodies[0] == 0);
  CHECK(rig.sink.frames[0].root_position_m == Vec3f{1, 0, -2});
  CHECK(rig.sink.frames[0].valid[0]);
}

TEST_CASE("a description becomes bodies with skeletons") {
  const auto layout = layout_of(two_bodies());
  REQUIRE(layout);
  REQUIRE((*layout)->bodies.size() == 2);
  const Body& bo = (*layout)->bodies[1];
  CHECK(bo.name == "Bo");
  REQUIRE(bo.skeleton->joints.size() == 2);
  CHECK(bo.skeleton->joints[1].name == "head");
  CHECK(bo.skeleton->joints[1].parent == 0);
  CHECK(bo.skeleton->joints[1].offset_m.y() == Approx(0.5));
  CHECK(layout_of({}).value()->bodies.empty());
}

TEST_CASE("a wrong description is refused with a sentence that names the fault") {
  const auto refused = [](const std::vector<BodyEntry>& bodies, const std::string& word) {
    const auto layout = layout_of(bodies);
    REQUIRE_FALSE(layout);
    INFO(layout.error().message);
    CHECK(layout.error().message.find(word) != std::string::npos);
    CHECK(layout.error().message.find('\n') == std::string::npos);
  };
  auto bodies = two_bodies();
  bodies[1].name = "Ann";
  refused(bodies, "two bodies");
  bodies = two_bodies();
  bodies[1].id = 5;
  refused(bodies, "two bodies");
  bodies = two_bodies();
  bodies[1].joints[1].name = "hips";
  refused(bodies, "two joints 'hips'");
  for (const int parent : {-2, -1, 1, 2}) {
    bodies = two_bodies();
    bodies[1].joints[1].parent = parent;
    refused(bodies, "wrong parent");
  }
  bodies = two_bodies();
  bodies[0].joints[0].parent = 0;
  refused(bodies, "wrong parent");
  bodies = two_bodies();
  bodies[0].joints[0].offset_m[2] = std::nanf("");
  refused(bodies, "out of the room");
  bodies = two_bodies();
  bodies[0].name = "";
  refused(bodies, "empty name");
  bodies[0].name = "a\nb";
  refused(bodies, "not text");
  bodies = two_bodies();
  bodies[0].joints.clear();
  refused(bodies, "0 joints");
  bodies[0].joints.assign(kMaxJoints + 1, {"x", -1, {}});
  refused(bodies, "97 joints");
  refused(std::vector<BodyEntry>(kMaxBodies + 1, two_bodies()[0]), "65 bodies");
  const Bytes whole = content_of(mocap::encode_description(two_bodies()));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CHECK_FALSE(find_driver("template_mocap")->make_layout(std::span(whole).first(size)));
  }
  Bytes longer = whole;
  longer.push_back({});
  CHECK_FALSE(find_driver("template_mocap")->make_layout(longer));
}

TEST_CASE("counts that promise more than there is cost no memory") {
  const Bytes greedy{std::byte{64}, std::byte{1},   std::byte{0},
                     std::byte{1},  std::byte{'a'}, std::byte{96}};
  const auto layout = find_driver("template_mocap")->make_layout(greedy);
  REQUIRE_FALSE(layout);
  CHECK(layout.error().message.find("ends too early") != std::string::npos);
}

TEST_CASE("frames before the first layout are counted and not emitted") {
  CollectSink sink;
  test::decoder_of(*find_driver("template_mocap"))
      ->feed(mocap::encode_frame({1, 0, {still(5, 1)}}), 0, sink);
  CHECK(sink.frames.empty());
  CHECK(sink.count(Outcome::kForeign) == 1);
}

TEST_CASE("a frame that contradicts the layout is counted, and the bodies beside it are kept") {
  Rig rig;
  rig.send({still(5, 1), still(300, 2)});
  CHECK(rig.sink.bodies == std::vector<std::size_t>{0, 1});
  rig.send({still(5, 2), still(300, 2)});  // joints
  CHECK(rig.sink.bodies == std::vector<std::size_t>{0, 1, 1});
  rig.send({still(6, 1), still(5, 1)});  // an unknown body
  CHECK(rig.sink.bodies == std::vector<std::size_t>{0, 1, 1, 0});
  rig.send({still(5, 1), still(5, 1)});  // twice the same
  CHECK(rig.sink.frames.size() == 5);
  BodyPose broken = still(5, 1);
  broken.rotation_xyzw[0] = {0.5F, 0, 0, 0.5F};
  rig.send({broken});
  broken = still(5, 1);
  broken.root_m[1] = 2000.0F;
  rig.send({broken});
  broken.root_m[1] = std::nanf("");
  rig.send({broken});
  CHECK(rig.sink.frames.size() == 5);
  CHECK(rig.sink.count(Outcome::kOk) == 1);
  CHECK(rig.sink.count(Outcome::kOutOfRange) == 6);
}

TEST_CASE("a joint that was not seen is not valid") {
  Rig rig;
  BodyPose pose = still(300, 2);
  pose.rotation_xyzw[1] = {};
  rig.send({pose});
  REQUIRE(rig.sink.frames.size() == 1);
  CHECK(rig.sink.frames[0].valid[0]);
  CHECK_FALSE(rig.sink.frames[0].valid[1]);
  CHECK(rig.sink.frames[0].rotation_xyzw[1] == kIdentity);
}

TEST_CASE("late and repeated datagrams are dropped, a restarted system goes on") {
  Rig rig;
  const auto feed = [&](std::initializer_list<std::uint32_t> numbers) {
    for (const std::uint32_t number : numbers) {
      rig.decoder->feed(mocap::encode_frame({number, number * 10'000, {still(5, 1)}}), 0, rig.sink);
    }
  };
  feed({100, 102, 101, 102, 90, 103});  // 101, 102 and 90 are late or repeated
  feed({0, 1});                         // started again
  CHECK(rig.sink.frames.size() == 5);
  CHECK(rig.sink.count(Outcome::kLate) == 2);
  CHECK(rig.sink.count(Outcome::kDuplicate) == 1);
  CHECK(rig.sink.frames[2].header.device_ns == 30'000'000);  // a late frame moves no clock
  CHECK(rig.sink.frames[3].header.device_ns == 30'000'000);  // time does not go back
  CHECK(rig.sink.frames[4].header.device_ns == 40'000'000);
}

TEST_CASE("damaged datagrams are told apart") {
  Rig rig;
  const Bytes good = mocap::encode_frame({1, 0, {still(5, 1)}});
  const auto outcome_of = [&](const Bytes& bytes) {
    rig.sink.clear();
    rig.decoder->feed(bytes, 0, rig.sink);
    CHECK(rig.sink.frames.empty());
    for (int i = 1; i < kOutcomes; ++i) {
      if (rig.sink.count(static_cast<Outcome>(i)) == 1) return static_cast<Outcome>(i);
    }
    return Outcome::kOk;
  };
  Bytes flipped = good;
  flipped[20] ^= std::byte{1};
  CHECK(outcome_of(flipped) == Outcome::kBadChecksum);
  CHECK(outcome_of({good.begin(), good.end() - 1}) == Outcome::kShort);
  Bytes longer = good;
  longer.push_back({});
  CHECK(outcome_of(longer) == Outcome::kShort);
  Bytes other = good;
  other[0] = std::byte{'X'};
  CHECK(outcome_of(other) == Outcome::kForeign);
  CHECK(outcome_of({}) == Outcome::kForeign);
  CHECK(outcome_of(mocap::encode_request()) == Outcome::kForeign);
}

TEST_CASE("bodies come and go, each described before its first frame") {
  MocapEmulator emulator(100.0);
  Session session;
  for (int i = 0; i < 11; ++i) session.step(emulator);
  CHECK(session.layouts.size() == 1);
  CHECK(session.sink.frames.size() == 20);
  emulator.set_present(0, false);
  session.step(emulator);
  REQUIRE(session.layouts.size() == 2);
  CHECK(session.layouts.back()->bodies.size() == 1);
  CHECK(session.layouts.back()->bodies[0].name == "Waver");
  for (int i = 0; i < 10; ++i) session.step(emulator);
  CHECK(session.sink.frames.size() == 30);
  emulator.set_present(0, true);
  for (int i = 0; i < 11; ++i) session.step(emulator);
  CHECK(session.layouts.back()->bodies.size() == 2);
  CHECK(session.sink.frames.size() == 50);
  CHECK(session.sink.count(Outcome::kOk) == 33);
  for (int i = 1; i < kOutcomes; ++i) CHECK(session.sink.count(static_cast<Outcome>(i)) == 0);
}

TEST_CASE("the description comes every second and on request") {
  MocapEmulator emulator(100.0);
  Session session;
  while (emulator.next_due_ns() < 3 * kNanosPerSecond) session.step(emulator);
  CHECK(session.layouts.size() == 3);
  Bytes answer;
  const std::int64_t due_ns = emulator.next_due_ns();
  session.step(emulator);  // the description of the third second
  emulator.receive(mocap::encode_request(), due_ns, answer);
  session.step(emulator);
  CHECK(session.layouts.size() == 5);
  emulator.receive(Bytes(20), due_ns, answer);
  session.step(emulator);
  CHECK(session.layouts.size() == 5);
  CHECK(answer.empty());
}

TEST_CASE("the emulated people move smoothly and for ever") {
  MocapEmulator emulator(100.0);
  Session session;
  CollectSink& sink = session.sink;
  for (int i = 0; i < 1300; ++i) session.step(emulator);
  double farthest = 0.0;
  for (std::size_t i = 2; i < sink.frames.size(); ++i) {
    CHECK(test::is_valid(sink.frames[i]));
    for (std::size_t k = 0; k < 3; ++k) {
      const double step_m = std::abs(static_cast<double>(sink.frames[i].root_position_m[k]) -
                                     static_cast<double>(sink.frames[i - 2].root_position_m[k]));
      farthest = std::max(farthest, step_m);
    }
  }
  CHECK(farthest > 0.0);
  CHECK(farthest < 0.01);
}

TEST_CASE("any description is refused or becomes bodies, and decoding it does not allocate") {
  std::mt19937 random(23);
  const Bytes good = mocap::encode_description(two_bodies());
  Rig rig;
  for (int round = 0; round < 2000; ++round) {
    Bytes bad = content_of(good);
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    }
    const auto layout = find_driver("template_mocap")->make_layout(bad);
    if (!layout) CHECK_FALSE(layout.error().message.empty());
  }
  const std::uint64_t before = test::allocations();
  rig.decoder->feed(good, 0, rig.sink);
  CHECK(test::allocations() == before);
  CHECK(rig.sink.descriptions == 1);
}

TEST_CASE("wrong options of the mocap system are refused at once") {
  const Driver& driver = *find_driver("template_mocap");
  test::check_refused(driver, {{{{"listen", std::string("nonsense")}}, "an address and a port"},
                               {{{"listen", std::string("0.0.0.0:7400")}}, "peers"},
                               {{{"peers", std::string("studio")}}, "an address in numbers"},
                               {{{"group", std::string("239.1.1.1")}}, "listen on 0.0.0.0:PORT"},
                               {{{"rate_hz", 0.0}}, "rate_hz"}});
  test::check_undescribed(driver,
                          {"", "template_mocap", "template_mocap rate=", "template_mocap rate=nan",
                           "template_mocap rate=0", "template_mocap rate=1e9"});
}

namespace {

// A frame before the description, both bodies, damage, a repeated datagram, and one body leaving.
std::string emulated_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of the template mocap system, with damage put "
      "in.\ndriver template_mocap\nidentity udp 127.0.0.1:7400\ntext template_mocap rate=100\n";
  MocapEmulator emulator(100.0);
  const Bytes first = next(emulator);
  text += test::recorded_row(1'000'000, "hex", next(emulator)) +
          test::recorded_row(2'000'000, "hex", first) +
          test::recorded_row(2'000'000, "bodies", content_of(first));
  for (int i = 1; i <= 12; ++i) {
    const std::int64_t at_ns = i * 10'000'000;
    if (i == 9) emulator.set_present(0, false);
    Bytes bytes = next(emulator);
    if (i == 3) bytes[40] ^= std::byte{0x10};
    if (i == 5) bytes.resize(bytes.size() / 2);
    if (i == 9) text += test::recorded_row(at_ns, "bodies", content_of(bytes));
    text += test::recorded_row(at_ns, "hex", bytes);
    if (i == 7) text += test::recorded_row(at_ns, "hex", bytes);
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated mocap system", "[.write-logs]") {
  const auto path = test::golden("devices") / "template-mocap.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_log();
}

}  // namespace posed::drivers::mocap
