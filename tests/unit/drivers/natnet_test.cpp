// The NatNet driver with its own emulator: every version there and back, bodies that change, what
// it asks the server, and its options. The recordings are in natnet_recording_test.cpp, bad input
// in natnet_damage_test.cpp.
#include <catch2/catch.hpp>

#include <array>
#include <fstream>

#include "drivers/natnet/decoder.hpp"
#include "drivers/natnet/emulator.hpp"
#include "drivers/natnet/figure.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/natnet_rig.hpp"
#include "tests/unit/drivers/recorded_log.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers {
namespace {

using natnet::MessageId;
using natnet::NatNetEmulator;
using natnet::Settings;
using natnet::Version;
using test::NatNetBytes;
using test::NatNetRig;

constexpr std::array<Version, 10> kNatNetVersions{
    {{2, 5}, {2, 6}, {2, 7}, {2, 9}, {2, 11}, {3, 0}, {3, 1}, {4, 0}, {4, 1}, {4, 5}}};

std::string text_of(Version version) {
  return std::to_string(version.major) + '.' + std::to_string(version.minor);
}

NatNetBytes next(NatNetEmulator& emulator) {
  NatNetBytes bytes;
  emulator.emit(emulator.next_due_ns(), bytes);
  return bytes;
}

NatNetBytes asked(NatNetEmulator& emulator, const NatNetBytes& question) {
  NatNetBytes answer;
  emulator.receive(question, 0, answer);
  return answer;
}

// All joints turned, each in its own way.
Frame bent_pose(const Skeleton& skeleton) {
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  frame.root_position_m = {0.3F, 1.1F, -0.7F};
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    const double turn = 0.1 + 0.03 * static_cast<double>(j);
    frame.rotation_xyzw[j] =
        from_eigen(axis_rotation(Axis::kX, turn) * axis_rotation(Axis::kY, 0.5 * turn) *
                   axis_rotation(Axis::kZ, -turn));
    frame.valid.set(j);
  }
  return frame;
}

void check_same_rotations(const Frame& got, const Frame& expected) {
  REQUIRE(got.joint_count == expected.joint_count);
  for (std::size_t j = 0; j < got.joint_count; ++j) {
    CHECK(got.valid[j] == expected.valid[j]);
    if (!expected.valid[j]) continue;
    CHECK(angle_between_rad(to_eigen_double(got.rotation_xyzw[j]),
                            to_eigen_double(expected.rotation_xyzw[j])) < 1e-5);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(static_cast<double>(got.root_position_m[i]) ==
          Approx(static_cast<double>(expected.root_position_m[i])).margin(1e-6));
  }
}

// Poses both bodies, feeds `frames` frames and compares them.
void check_round_trip(NatNetEmulator& emulator, NatNetRig& rig) {
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);  // the bodies
  REQUIRE(rig.layout().bodies.size() == 2);
  for (std::size_t body = 0; body < 2; ++body) {
    REQUIRE(rig.layout().bodies[body].skeleton->id == emulator.skeleton(body)->id);
    emulator.pose(body, bent_pose(*emulator.skeleton(body)));
  }
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  REQUIRE(rig.sink.bodies == std::vector<std::size_t>{1, 0});
  check_same_rotations(rig.sink.frames[1], bent_pose(*emulator.skeleton(0)));
  check_same_rotations(rig.sink.frames[0], bent_pose(*emulator.skeleton(1)));
  REQUIRE(rig.sink.samples.size() == 1);
  REQUIRE(rig.sink.sample_bodies == std::vector<std::size_t>{1});
  const Sample& sample = rig.sink.samples[0];
  const Frame wand = bent_pose(*emulator.skeleton(1));
  REQUIRE(sample.value_count == 12);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f expected_m =
        Eigen::Vector3f(wand.root_position_m.data()) +
        to_eigen(wand.rotation_xyzw[0]) * Eigen::Vector3f(natnet::kWandMarkers_m[i].data());
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t value = 3 * i + static_cast<std::size_t>(axis);
      CHECK(static_cast<double>(sample.value[value]) ==
            Approx(static_cast<double>(expected_m[axis])).margin(1e-6));
    }
  }
}

}  // namespace

TEST_CASE("every NatNet version, there and back, told or found out") {
  for (const Version version : kNatNetVersions) {
    for (const bool reported : {true, false}) {
      INFO(text_of(version) << (reported ? " told" : " found out"));
      NatNetEmulator emulator(Settings{.version = version});
      NatNetRig rig;
      if (reported) REQUIRE(rig.feed(asked(emulator, natnet::encode_connect())) == Outcome::kOk);
      check_round_trip(emulator, rig);
      const Sample& sample = rig.sink.samples[0];
      CHECK(sample.valid[8]);
      CHECK(sample.valid[9] == (version < Version{2, 6}));  // before, nothing says so
      for (int i = 0; i < 120; ++i) REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
      const auto& frames = rig.sink.frames;
      const double second_s = seconds(frames.back().header.device_ns - frames[0].header.device_ns);
      CHECK(second_s == Approx(1.0).margin(1e-5));
    }
  }
}

TEST_CASE("all bodies of a NatNet packet carry its timecode") {
  NatNetEmulator emulator(Settings{});
  NatNetRig rig;
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);  // the bodies
  const auto& person = static_cast<const natnet::NatNetLayout&>(rig.layout()).tables[0];
  natnet::FramePacket packet;
  packet.rigid_bodies.push_back({.id = natnet::kWandId, .rotation_xyzw = kIdentity});
  natnet::SkeletonPacket& skeleton = packet.skeletons.emplace_back();
  skeleton.id = person.id;
  for (const auto bone : person.bone_ids) {
    skeleton.bones.push_back({.id = person.id << 16 | bone, .rotation_xyzw = kIdentity});
  }
  for (const std::uint32_t timecode : {0x01020304U, 0U}) {
    rig.sink.clear();
    ++packet.number;
    packet.timecode = timecode;
    const natnet::Reading reading{.version = Settings{}.version, .timestamp = true};
    REQUIRE(rig.feed(natnet::encode_frame(packet, reading)) == Outcome::kOk);
    REQUIRE(rig.sink.frames.size() == 2);
    for (const Frame& frame : rig.sink.frames) {
      CHECK(view_of(frame.timecode) == (timecode == 0 ? "" : "01:02:03:04"));
    }
  }
}

TEST_CASE("NatNet's axes and skeleton coordinates come out the same") {
  for (const std::string up : {"y", "z"}) {
    for (const std::string sent : {"local", "global"}) {
      for (const std::string read : {"auto", sent.c_str()}) {
        INFO(up << " up, " << sent << " read as " << read);
        const auto emulator =
            find_driver("natnet")->emulate({{"up", up}, {"coordinates", sent}}).value();
        NatNetRig rig({{"up", up}, {"coordinates", read}});
        check_round_trip(dynamic_cast<NatNetEmulator&>(*emulator), rig);
      }
    }
  }
}

TEST_CASE("the person of the NatNet emulator is a whole humanoid with fingers") {
  const NatNetEmulator emulator{Settings{}};
  const Skeleton& person = *emulator.skeleton(0);
  CHECK(person.joints.size() == 51);
  CHECK(person.joints[0].name == "Hip");
  for (int i = 0; i < kBones; ++i) {
    const auto bone = static_cast<Bone>(i);
    INFO(bone_name(bone));
    CHECK((person.joint_of(bone) >= 0) == (bone != Bone::kUpperChest));
  }
  for (const Joint& joint : person.joints) {
    CHECK(joint.T_world_joint.isApprox(Eigen::Quaterniond::Identity()));
  }
  CHECK(emulator.skeleton(1)->joints.size() == 1);
  CHECK(emulator.skeleton(2) == nullptr);
}

TEST_CASE("bone names of the other conventions of Motive are known, too") {
  natnet::ModelDef model;
  model.bodies.push_back({.name = "Bo", .id = 3, .is_skeleton = true, .bones = {}});
  auto& bones = model.bodies[0].bones;
  bones = {{.name = "Bo_Hips", .id = 1, .parent = 0},
           {.name = "Bo_LeftUpLeg", .id = 7, .parent = 1, .offset_m = {0.1F, 0, 0}},
           {.name = "Bo_Spine", .id = 2, .parent = 1, .offset_m = {0, 0.1F, 0}},
           {.name = "Bo_LeftLeg", .id = 8, .parent = 7, .offset_m = {0, -0.4F, 0.01F}}};
  const auto layout =
      natnet::make_layout(natnet::encode_description(model, {3, 0}, {.version = {3, 0}}));
  REQUIRE(layout);
  const Skeleton& skeleton = *(*layout)->bodies.at(0).skeleton;
  CHECK(skeleton.joint_of(Bone::kHips) == 0);
  CHECK(skeleton.joint_of(Bone::kLeftUpperLeg) == 1);
  CHECK(skeleton.joint_of(Bone::kLeftLowerLeg) == 2);  // depth first
  CHECK(skeleton.joint_of(Bone::kSpine) == 3);
  CHECK(skeleton.joints[2].T_world_joint.isApprox(Eigen::Quaterniond::Identity()));
}

TEST_CASE("the readings that the sources of NatNet do not agree on") {
  NatNetEmulator emulator{Settings{}};
  natnet::FramePacket packet{.number = 1, .timestamp_s = 2.0};
  packet.skeletons.push_back({.id = 1, .bones = {}});
  for (std::int32_t bone = 1; bone <= 51; ++bone) {
    packet.skeletons[0].bones.push_back({.id = bone, .rotation_xyzw = kIdentity});
  }
  for (const natnet::Reading& sent :
       {natnet::Reading{.version = {2, 6}, .bones_have_params = false},
        natnet::Reading{.version = {2, 8}, .bones_have_params = false},
        natnet::Reading{.version = {2, 8}}, natnet::Reading{.version = {2, 5}},
        natnet::Reading{.version = {2, 5}, .timestamp = false},
        natnet::Reading{.version = {3, 0}, .padded = true}}) {
    for (const bool reported : {true, false}) {
      INFO(text_of(sent.version) << ' ' << sent.bones_have_params << sent.padded << reported);
      NatNetRig rig;
      if (reported) {
        REQUIRE(rig.feed(natnet::encode_server_info({.version = sent.version})) == Outcome::kOk);
      }
      REQUIRE(rig.feed(natnet::encode_model_def(natnet::emulated_model(), sent.version)) ==
              Outcome::kOk);
      packet.number = 1;
      REQUIRE(rig.feed(natnet::encode_frame(packet, sent)) == Outcome::kOk);
      packet.number = 2;
      REQUIRE(rig.feed(natnet::encode_frame(packet, sent)) == Outcome::kOk);
      CHECK(rig.sink.frames.size() == 2);
    }
  }
}

TEST_CASE("bodies of NatNet that are not tracked are not valid") {
  NatNetEmulator emulator{Settings{}};
  NatNetRig rig;
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  Frame person = bent_pose(*emulator.skeleton(0));
  person.valid.reset(emulator.skeleton(0)->joints.size() - 1);  // no other bone hangs on it
  emulator.pose(0, person);
  Frame wand = bent_pose(*emulator.skeleton(1));
  wand.valid.reset();
  emulator.pose(1, wand);
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  CHECK(rig.sink.frames[0].quality == Quality::kHeld);
  CHECK_FALSE(rig.sink.frames[0].valid[0]);
  CHECK(rig.sink.frames[0].rotation_xyzw[0] == kIdentity);
  CHECK(rig.sink.frames[1].quality == Quality::kMeasured);
  check_same_rotations(rig.sink.frames[1], person);
}

TEST_CASE("the bodies of a NatNet server change while it streams") {
  NatNetEmulator emulator{Settings{}};
  NatNetRig rig;
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  REQUIRE(rig.feed(asked(emulator, natnet::encode_connect())) == Outcome::kOk);
  const auto ask = [&](std::int64_t now_ns) {
    const Request request = rig.decoder->next_request(now_ns);
    CHECK(request.socket == 0);
    return NatNetBytes(request.bytes.begin(), request.bytes.end());
  };
  const auto rate = natnet::encode_text(MessageId::kRequest, "FrameRate");
  const auto bodies = natnet::encode_message(MessageId::kRequestModelDef, {});
  CHECK(ask(0) == rate);
  REQUIRE(rig.feed(asked(emulator, rate)) == Outcome::kOk);
  CHECK(ask(1) == bodies);
  CHECK(ask(2).empty());  // not again at once
  REQUIRE(rig.feed(asked(emulator, bodies)) == Outcome::kOk);
  CHECK(rig.layout().bodies[0].rate_hz == 120.0);
  CHECK(ask(kNanosPerSecond + 2).empty());
  emulator.set_wand(false);
  REQUIRE(rig.feed(next(emulator), kNanosPerSecond) == Outcome::kOk);
  CHECK(ask(kNanosPerSecond + 3) == bodies);
  REQUIRE(rig.feed(asked(emulator, bodies)) == Outcome::kOk);
  CHECK(rig.layout().bodies.size() == 1);
  rig.sink.clear();
  emulator.set_wand(true);
  CHECK(rig.feed(next(emulator), kNanosPerSecond) == Outcome::kOutOfRange);  // unknown so far
  CHECK(rig.sink.bodies == std::vector<std::size_t>{0});
  CHECK(ask(5 * kNanosPerSecond) == natnet::encode_connect());  // silent since 1 s
}

TEST_CASE("what a NatNet server is asked until it answers, and over unicast") {
  NatNetRig rig({{"unicast", true}});
  const auto is = [](const Request& request, MessageId id) {
    natnet::Message message;
    return natnet::decode_message(request.bytes, message) == Outcome::kOk && message.id == id;
  };
  std::int64_t now_ns = 0;
  int connects = 0;
  for (; now_ns < 3 * kNanosPerSecond; now_ns += natnet::Requests::kPeriod_ns) {
    const Request request = rig.decoder->next_request(now_ns);
    CHECK((request.bytes.empty() || is(request, MessageId::kConnect)));
    connects += request.bytes.empty() ? 0 : 1;
  }
  CHECK(connects == 3);
  NatNetEmulator emulator{Settings{}};
  const std::uint64_t before = test::allocations();
  (void)rig.decoder->next_request(now_ns);
  CHECK(test::allocations() == before);
  REQUIRE(rig.feed(asked(emulator, natnet::encode_connect()), now_ns) == Outcome::kOk);
  (void)next(emulator);  // its bodies, which nobody has asked for
  int alive = 0;
  int rates = 0;
  int bodies = 0;
  const std::int64_t start_ns = now_ns;
  for (; now_ns < start_ns + 10 * kNanosPerSecond; now_ns += natnet::Requests::kPeriod_ns) {
    const Outcome outcome = rig.feed(next(emulator), now_ns);
    CHECK(outcome == (rig.layouts.empty() ? Outcome::kForeign : Outcome::kOk));
    const Request request = rig.decoder->next_request(now_ns);
    alive += is(request, MessageId::kKeepAlive) ? 1 : 0;
    rates += is(request, MessageId::kRequest) ? 1 : 0;
    bodies += is(request, MessageId::kRequestModelDef) ? 1 : 0;
    const auto answer = asked(emulator, {request.bytes.begin(), request.bytes.end()});
    if (!answer.empty()) REQUIRE(rig.feed(answer, now_ns) == Outcome::kOk);
  }
  CHECK(alive == 10);
  CHECK(rates == 1);
  CHECK(bodies == 1);
}

TEST_CASE("the NatNet emulator answers the commands of a client") {
  NatNetEmulator emulator{Settings{}};
  const auto id_of = [&](MessageId id, std::span<const std::byte> payload) {
    const auto answer = asked(emulator, natnet::encode_message(id, payload));
    natnet::Message message;
    REQUIRE(natnet::decode_message(answer, message) == Outcome::kOk);
    return message.id;
  };
  const std::string ping("Ping\0", 5);
  CHECK(id_of(MessageId::kConnect, std::as_bytes(std::span(ping))) == MessageId::kServerInfo);
  CHECK(id_of(MessageId::kDiscovery, {}) == MessageId::kServerInfo);
  CHECK(id_of(MessageId::kRequest, std::as_bytes(std::span(ping))) == MessageId::kUnrecognized);
  const NatNetBytes ticks(8);
  CHECK(id_of(MessageId::kEchoRequest, ticks) == MessageId::kEchoResponse);
  CHECK(asked(emulator, natnet::encode_message(MessageId::kKeepAlive, {})).empty());
  CHECK(asked(emulator, NatNetBytes(3)).empty());
  CHECK(emulator.next_socket() == 0);
  (void)next(emulator);
  CHECK(emulator.next_socket() == 1);
  CHECK(emulator.ports() == std::vector<std::uint16_t>{1510, 0});
}

TEST_CASE("late and repeated NatNet frames are dropped, and device time never goes back") {
  NatNetEmulator emulator{Settings{}};
  NatNetRig rig;
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  const NatNetBytes first = next(emulator);
  const NatNetBytes second = next(emulator);
  const NatNetBytes third = next(emulator);
  CHECK(rig.feed(first) == Outcome::kOk);
  CHECK(rig.feed(third) == Outcome::kOk);
  CHECK(rig.feed(second) == Outcome::kLate);
  CHECK(rig.feed(third) == Outcome::kDuplicate);
  CHECK(rig.sink.frames.size() == 4);
  // The server says how fast it counts only now: the time goes on from the same value.
  const std::int64_t before_ns = rig.sink.frames.back().header.device_ns;
  REQUIRE(rig.feed(asked(emulator, natnet::encode_connect())) == Outcome::kOk);
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  REQUIRE(rig.feed(next(emulator)) == Outcome::kOk);
  const std::int64_t after_ns = rig.sink.frames.back().header.device_ns;
  CHECK(seconds(after_ns - before_ns) == Approx(1.0 / 120).margin(1e-6));
}

TEST_CASE("wrong options of NatNet are refused at once") {
  const Driver& driver = *find_driver("natnet");
  test::check_refused(driver,
                      {{{{"server", std::string("motive")}}, "in numbers"},
                       {{{"listen", std::string("nonsense")}}, "an address and a port"},
                       {{{"listen", std::string("127.0.0.1:1511")}}, "listen on 0.0.0.0:PORT"},
                       {{{"command_listen", std::string("x")}}, "an address and a port"},
                       {{{"group", std::string("10.0.0.1")}}, "multicast address"},
                       {{{"up", std::string("x")}}, "up"},
                       {{{"coordinates", std::string("world")}}, "coordinates"},
                       {{{"version", std::string("5.0")}}, "version"},
                       {{{"version", std::string("3")}}, "version"},
                       {{{"rate_hz", std::int64_t{0}}}, "rate_hz"}});
  const auto remote = driver.expect({{"server", std::string("192.168.1.20")},
                                     {"unicast", true},
                                     {"version", std::string("2.9")}});
  REQUIRE(remote);
  CHECK(remote->identity == "udp 192.168.1.20:1510");
  CHECK(remote->text == "natnet version=2.9 up=y coordinates=auto cast=uni rate=120");
  CHECK(driver.expect({{"server", std::string("10.0.0.2:1600")}})->identity == "udp 10.0.0.2:1600");
}

namespace {

// A frame before the description, damage, a repeated datagram, and a body that leaves.
std::string emulated_natnet_log() {
  const auto description = find_driver("natnet")->expect({}).value();
  std::string text =
      "# Not a recording: made by posed's emulator of a NatNet server, with damage put in.\n"
      "driver natnet\nidentity " +
      description.identity + "\ntext " + description.text + '\n';
  NatNetEmulator emulator{Settings{}};
  NatNetRig rig;
  const auto describe = [&](std::int64_t at_ns, const NatNetBytes& datagram) {
    REQUIRE(rig.feed(datagram) == Outcome::kOk);
    text += test::recorded_row(at_ns, "hex", datagram) +
            test::recorded_row(at_ns, "bodies", rig.sink.described);
  };
  const NatNetBytes bodies = next(emulator);
  text += test::recorded_row(1'000'000, "hex", asked(emulator, natnet::encode_connect()));
  text += test::recorded_row(2'000'000, "hex", next(emulator));
  describe(3'000'000, bodies);
  for (int i = 1; i <= 7; ++i) {
    const std::int64_t at_ns = i * 10'000'000;
    if (i == 6) emulator.set_wand(false);
    NatNetBytes bytes = next(emulator);
    if (i == 2) bytes[40] ^= std::byte{0x10};
    if (i == 3) bytes.resize(bytes.size() / 2);
    text += test::recorded_row(at_ns, "hex", bytes);
    if (i == 4) text += test::recorded_row(at_ns, "hex", bytes);
    if (i != 6) continue;
    describe(at_ns, asked(emulator, natnet::encode_message(MessageId::kRequestModelDef, {})));
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated NatNet server", "[.write-logs]") {
  const auto path = test::golden("devices/natnet.log");
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_natnet_log();
}

}  // namespace posed::drivers
