// Bad input of the NatNet driver: cut and flipped bytes, counts that promise too much, values that
// are no numbers, another version than the server says, and bodies that make no sense.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "drivers/byte_writer.hpp"
#include "drivers/natnet/figure.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/natnet_rig.hpp"

namespace posed::drivers {
namespace {

using natnet::BodyDef;
using natnet::FramePacket;
using natnet::MessageId;
using natnet::ModelDef;
using natnet::Reading;
using natnet::Version;
using test::NatNetBytes;
using test::NatNetRig;

// A skeleton of two bones and a rigid body with two markers.
ModelDef small_model() {
  ModelDef model;
  model.markers["Wand"] = 2;
  model.bodies.push_back(
      {.name = "Ann",
       .id = 1,
       .is_skeleton = true,
       .bones = {{.name = "Hip", .id = 1, .parent = 0},
                 {.name = "Ab", .id = 2, .parent = 1, .offset_m = {0, 0.1F, 0}}}});
  model.bodies.push_back({.name = "Wand", .id = 2, .bones = {{.name = "Wand", .id = 2}}});
  return model;
}

FramePacket small_frame(std::uint32_t number) {
  FramePacket packet{.number = number, .timestamp_s = number / 100.0};
  packet.skeletons.push_back(
      {.id = 1,
       .bones = {{.id = 0x10001, .position_m = {0, 1, 0}, .rotation_xyzw = kIdentity},
                 {.id = 0x10002, .position_m = {0, 1.1F, 0}, .rotation_xyzw = kIdentity}}});
  packet.rigid_bodies.push_back({.id = 2, .position_m = {1, 2, 3}, .rotation_xyzw = kIdentity});
  packet.labelled.push_back({.model = 2, .number = 1, .position_m = {1, 2, 3}});
  return packet;
}

// Knows the small bodies and the version.
struct SmallRig : NatNetRig {
  explicit SmallRig(Version version) {
    REQUIRE(feed(natnet::encode_server_info({.version = version})) == Outcome::kOk);
    REQUIRE(feed(natnet::encode_model_def(small_model(), version)) == Outcome::kOk);
  }
};

NatNetBytes number_120() {
  ByteWriter writer;
  writer.f32(120.0F);
  return writer.finish();
}

NatNetBytes cut_with_right_length(const NatNetBytes& datagram, std::size_t size) {
  NatNetBytes cut(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
  cut[2] = static_cast<std::byte>((size - 4) & 0xff);
  cut[3] = static_cast<std::byte>((size - 4) >> 8);
  return cut;
}

const std::vector<Version> kDamaged{{2, 5}, {2, 7}, {2, 9}, {3, 0}, {4, 0}, {4, 1}};

}  // namespace

TEST_CASE("a NatNet frame that is cut anywhere is counted and gives nothing") {
  for (const Version version : kDamaged) {
    SmallRig rig(version);
    const NatNetBytes whole = natnet::encode_frame(small_frame(1), {.version = version});
    rig.sink.clear();
    for (std::size_t size = 0; size < whole.size(); ++size) {
      INFO(int{version.major} << '.' << int{version.minor} << ' ' << size);
      CHECK(rig.feed(std::span(whole).first(size)) == Outcome::kShort);
      if (size < 4) continue;
      CHECK(rig.feed(cut_with_right_length(whole, size)) == Outcome::kOutOfRange);
    }
    NatNetBytes longer = whole;
    longer.push_back({});
    CHECK(rig.feed(longer) == Outcome::kShort);
    CHECK(rig.sink.frames.empty());
    CHECK(rig.feed(whole) == Outcome::kOk);
    CHECK(rig.sink.frames.size() == 2);
  }
}

TEST_CASE("any NatNet count may be negative or huge, and nothing is allocated") {
  for (const Version version : kDamaged) {
    SmallRig rig(version);
    const NatNetBytes whole = natnet::encode_frame(small_frame(1), {.version = version});
    NatNetBytes bad = whole;
    const std::uint64_t before = test::allocations();
    for (std::size_t place = 4; place + 4 <= whole.size(); ++place) {
      for (const std::int32_t count : {-1, std::numeric_limits<std::int32_t>::min(),
                                       std::numeric_limits<std::int32_t>::max(), 70'000, 1000}) {
        std::memcpy(bad.data() + place, &count, sizeof count);
        rig.sink.clear();
        rig.decoder->feed(bad, 0, rig.sink);
        std::memcpy(bad.data() + place, whole.data() + place, sizeof count);
        for (const Frame& frame : rig.sink.frames) {
          if (!test::is_valid(frame)) FAIL("a frame is not sound");
        }
      }
    }
    CHECK(test::allocations() == before);
  }
}

TEST_CASE("NatNet values that are no numbers or out of the room spoil their body only") {
  const Version version{3, 0};
  SmallRig rig(version);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::uint32_t number = 0;
  const auto bodies_of = [&](const FramePacket& packet, Outcome expected) {
    rig.sink.clear();
    CHECK(rig.feed(natnet::encode_frame(packet, {.version = version})) == expected);
    return rig.sink.bodies;
  };
  using Bodies = std::vector<std::size_t>;
  for (const float wrong : {nan, std::numeric_limits<float>::infinity(), 2000.0F}) {
    FramePacket packet = small_frame(++number);
    packet.rigid_bodies[0].position_m[1] = wrong;
    CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{0});
    packet = small_frame(++number);
    packet.skeletons[0].bones[1].position_m[2] = wrong;
    CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1});
    packet = small_frame(++number);
    packet.skeletons[0].bones[1].rotation_xyzw[2] = wrong;
    CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1});
    packet = small_frame(++number);
    packet.labelled[0].position_m[0] = wrong;
    CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1, 0});
    CHECK(rig.sink.samples.empty());
  }
  FramePacket packet = small_frame(++number);
  packet.rigid_bodies[0].rotation_xyzw = {};
  CHECK(bodies_of(packet, Outcome::kOk) == Bodies{1, 0});
  CHECK_FALSE(rig.sink.frames[0].valid[0]);
  packet = small_frame(++number);
  packet.rigid_bodies.push_back(packet.rigid_bodies[0]);  // twice
  CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1, 0});
  packet = small_frame(++number);
  packet.skeletons[0].bones.pop_back();
  CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1});
  packet = small_frame(++number);
  packet.skeletons[0].bones[1].id = 0x10001;
  CHECK(bodies_of(packet, Outcome::kOutOfRange) == Bodies{1});
  packet = small_frame(++number);
  packet.timestamp_s = std::numeric_limits<double>::quiet_NaN();
  CHECK(bodies_of(packet, Outcome::kOk) == Bodies{1, 0});
  packet = small_frame(++number);
  packet.labelled[0].number = 3;  // the wand has two
  CHECK(bodies_of(packet, Outcome::kOk) == Bodies{1, 0});
  CHECK(rig.sink.samples.empty());
}

TEST_CASE("a NatNet server that says a wrong version gives nothing, and the option mends it") {
  SmallRig rig({2, 9});
  const NatNetBytes newer = natnet::encode_frame(small_frame(1), {.version = {3, 0}});
  for (int i = 0; i < 20; ++i) CHECK(rig.feed(newer) == Outcome::kOutOfRange);
  CHECK(rig.sink.frames.empty());
  NatNetRig mended({{"version", std::string("3.0")}});
  REQUIRE(mended.feed(natnet::encode_server_info({.version = {2, 9}})) == Outcome::kOk);
  REQUIRE(mended.feed(natnet::encode_model_def(small_model(), {3, 0})) == Outcome::kOk);
  CHECK(mended.feed(newer) == Outcome::kOk);
}

TEST_CASE("a NatNet server that is replaced by one of another version is understood again") {
  SmallRig rig({2, 9});
  CHECK(rig.feed(natnet::encode_frame(small_frame(1), {.version = {2, 9}})) == Outcome::kOk);
  REQUIRE(rig.feed(natnet::encode_server_info({.version = {4, 1}})) == Outcome::kOk);
  CHECK(rig.feed(natnet::encode_frame(small_frame(2), {.version = {4, 1}})) == Outcome::kOk);
  // Nobody says it: after a few frames the new version is tried.
  NatNetRig alone;
  REQUIRE(alone.feed(natnet::encode_model_def(small_model(), {3, 0})) == Outcome::kOk);
  REQUIRE(alone.feed(natnet::encode_frame(small_frame(1), {.version = {3, 0}})) == Outcome::kOk);
  int lost = 0;
  std::uint32_t number = 2;
  while (alone.feed(natnet::encode_frame(small_frame(number++), {.version = {4, 1}})) !=
         Outcome::kOk) {
    REQUIRE(++lost < 20);
  }
  CHECK(lost == 7);
}

TEST_CASE("a NatNet server is asked again when its frames no longer fit") {
  SmallRig rig({3, 1});
  std::int64_t now_ns = 0;
  const auto asked = [&] {
    now_ns += kNanosPerSecond;
    const Request request = rig.decoder->next_request(now_ns);
    natnet::Message message;
    return natnet::decode_message(request.bytes, message) == Outcome::kOk ? message.id
                                                                          : MessageId::kFrame;
  };
  CHECK(asked() == MessageId::kRequest);
  REQUIRE(rig.feed(natnet::encode_message(MessageId::kResponse, number_120()), now_ns) ==
          Outcome::kOk);
  CHECK(asked() == MessageId::kFrame);  // nothing
  FramePacket packet = small_frame(1);
  packet.skeletons[0].bones.push_back({.id = 0x10003, .rotation_xyzw = kIdentity});
  CHECK(rig.feed(natnet::encode_frame(packet, {.version = {3, 1}}), now_ns) ==
        Outcome::kOutOfRange);
  CHECK(asked() == MessageId::kRequestModelDef);
  REQUIRE(rig.feed(natnet::encode_model_def(small_model(), {3, 1}), now_ns) == Outcome::kOk);
  for (std::uint32_t number = 2; number < 10; ++number) {
    CHECK(asked() == MessageId::kFrame);
    CHECK(rig.feed(natnet::encode_frame(small_frame(number), {.version = {4, 1}}), now_ns) ==
          Outcome::kOutOfRange);
  }
  CHECK(asked() == MessageId::kConnect);
  REQUIRE(rig.feed(natnet::encode_server_info({.version = {4, 1}}), now_ns) == Outcome::kOk);
  CHECK(rig.feed(natnet::encode_frame(small_frame(10), {.version = {4, 1}}), now_ns) ==
        Outcome::kOk);
}

TEST_CASE(
    "a NatNet server that never fits is asked less and less often, and its answers are junk") {
  SmallRig rig({2, 9});
  std::uint32_t number = 1;
  int asked = 0, of_use = 0;
  constexpr int kMinutes = 10;
  for (int i = 0; i < kMinutes * 60 * 10; ++i) {
    const std::int64_t now_ns = i * (kNanosPerSecond / 10);
    CHECK(rig.feed(natnet::encode_frame(small_frame(number++), {.version = {3, 0}}), now_ns) ==
          Outcome::kOutOfRange);
    natnet::Message message;
    const Request request = rig.decoder->next_request(now_ns);
    if (natnet::decode_message(request.bytes, message) != Outcome::kOk) continue;
    if (message.id != MessageId::kConnect) continue;
    ++asked;
    const Outcome answer = rig.feed(natnet::encode_server_info({.version = {2, 9}}), now_ns);
    of_use += answer == Outcome::kOk ? 1 : 0;
  }
  CHECK(asked <= 6 + 2 * kMinutes);
  CHECK(of_use == 0);
  // Once it is another one, it is understood at the next answer.
  REQUIRE(rig.feed(natnet::encode_server_info({.version = {3, 0}})) == Outcome::kOk);
  CHECK(rig.feed(natnet::encode_frame(small_frame(number), {.version = {3, 0}})) == Outcome::kOk);
}

TEST_CASE("messages of NatNet that are not for posed, and frames before the bodies are known") {
  NatNetRig rig;
  CHECK(rig.feed(natnet::encode_frame(small_frame(1), {.version = {3, 0}})) == Outcome::kForeign);
  CHECK(rig.feed(NatNetBytes{}) == Outcome::kShort);
  CHECK(rig.feed(natnet::encode_message(static_cast<natnet::MessageId>(77), {})) ==
        Outcome::kForeign);
  CHECK(rig.feed(natnet::encode_connect()) == Outcome::kForeign);
  CHECK(rig.feed(natnet::encode_message(natnet::MessageId::kServerInfo, {})) == Outcome::kShort);
  CHECK(rig.feed(natnet::encode_message(natnet::MessageId::kResponse, {})) == Outcome::kOutOfRange);
  CHECK(rig.feed(natnet::encode_text(natnet::MessageId::kMessageText, "hello")) == Outcome::kOk);
}

TEST_CASE("wrong descriptions of NatNet are refused with a sentence that names the fault") {
  const auto refused = [](const ModelDef& model, const std::string& word) {
    for (const Version version : {Version{2, 9}, Version{3, 0}, Version{4, 1}}) {
      const auto layout = find_driver("natnet")->make_layout(
          natnet::encode_description(model, version, {.version = version}));
      REQUIRE_FALSE(layout);
      INFO(layout.error().message);
      CHECK(layout.error().message.find(word) != std::string::npos);
    }
  };
  ModelDef model = small_model();
  model.bodies[0].bones[1].parent = 7;
  refused(model, "exactly one bone without a parent");
  model.bodies[0].bones[0].parent = 2;
  model.bodies[0].bones[1].parent = 1;
  refused(model, "exactly one bone without a parent");
  model = small_model();
  model.bodies[0].bones.push_back({.name = "x", .id = 3, .parent = 4});
  model.bodies[0].bones.push_back({.name = "y", .id = 4, .parent = 3});
  refused(model, "each other's parents");
  model = small_model();
  model.bodies[0].bones[1].id = 1;
  refused(model, "the same number");
  model = small_model();
  model.bodies[0].bones.clear();
  refused(model, "0 bones");
  model = small_model();
  model.bodies[0].bones.resize(97, {.name = "x", .id = 5, .parent = 1});
  refused(model, "97 bones");
  model = small_model();
  model.bodies[0].bones[1].offset_m[0] = std::nanf("");
  refused(model, "out of the room");
  model = small_model();
  model.bodies[0].bones[1].name = "Hip";
  refused(model, "not usable");
  model = small_model();
  model.bodies.push_back(model.bodies[1]);
  refused(model, "the number of another one");
  model = small_model();
  model.bodies.assign(65, model.bodies[1]);
  refused(model, "65 bodies");
  const auto damaged = [](const NatNetBytes& bytes) {
    return !find_driver("natnet")->make_layout(bytes).has_value();
  };
  for (const Version version : kDamaged) {
    const NatNetBytes whole =
        natnet::encode_description(small_model(), version, {.version = version});
    for (std::size_t size = 0; size < whole.size(); ++size) {
      CHECK(damaged({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}));
    }
    NatNetBytes longer = whole;
    longer.push_back({});
    CHECK(damaged(longer));
  }
}

// As NatNetClient.py of the vendor's SDK 4.2 reads it
// (__unpack_rigid_body_descript_4_2_to_current).
TEST_CASE("a body of NatNet 4.2 has a rotation behind its place") {
  ByteWriter body;
  body.text(std::string_view("Wand\0", 5));
  for (const std::int32_t id_parent : {7, -1}) body.i32(id_parent);
  for (const float place_rotation : {0.1F, 0.2F, 0.3F, 0.0F, 0.0F, 0.0F, 1.0F}) {
    body.f32(place_rotation);
  }
  body.i32(0);  // markers
  ByteWriter model;
  for (const std::int32_t count_kind : {1, 1}) model.i32(count_kind);
  model.i32(static_cast<std::int32_t>(body.size()));
  model.bytes(body.written());
  for (const Version said : {Version{4, 2}, Version{4, 5}, Version{}}) {
    NatNetBytes whole(natnet::kDescriptionHeadBytes);
    natnet::write_description_head({.version = said},
                                   std::span(whole).first<natnet::kDescriptionHeadBytes>());
    whole.insert(whole.end(), model.written().begin(), model.written().end());
    const auto layout = find_driver("natnet")->make_layout(whole);
    REQUIRE(layout);
    REQUIRE((*layout)->bodies.size() == 1);
    CHECK((*layout)->bodies[0].name == "Wand");
  }
}

TEST_CASE("descriptions of NatNet are read in any version, told or not") {
  for (const Version version :
       {Version{2, 9}, Version{3, 0}, Version{4, 0}, Version{4, 1}, Version{4, 2}}) {
    for (const Version said : {Version{}, version, Version{3, 0}}) {
      const auto layout = find_driver("natnet")->make_layout(
          natnet::encode_description(natnet::emulated_model(), version, {.version = said}));
      REQUIRE(layout);
      CHECK((*layout)->bodies.size() == 2);
      CHECK((*layout)->bodies[1].samples.names.size() == 12);
    }
  }
  // A force plate before the bodies, as github.com/FerroO2000/natnet-go (force_plate.go) reads it;
  // from 4.1 on, its size stands before it.
  for (const Version version : {Version{3, 0}, Version{4, 0}, Version{4, 1}}) {
    ByteWriter plate;
    plate.i32(1);
    plate.text(std::string_view("AMTI\0", 5));
    for (int word = 0; word < 2 + 3 + 144 + 12; ++word) plate.f32(0.4F);
    for (const std::int32_t type_data_channels : {0, 0, 1}) plate.i32(type_data_channels);
    plate.text(std::string_view("Fx\0", 3));
    ByteWriter entry;
    entry.i32(3);
    if (version >= Version{4, 1}) entry.i32(static_cast<std::int32_t>(plate.size()));
    entry.bytes(plate.written());
    NatNetBytes whole = natnet::encode_description(small_model(), version, {.version = version});
    const auto count = whole.begin() + natnet::kDescriptionHeadBytes;
    *count = static_cast<std::byte>(std::to_integer<int>(*count) + 1);
    whole.insert(count + 4, entry.written().begin(), entry.written().end());
    const auto layout = find_driver("natnet")->make_layout(whole);
    REQUIRE(layout);
    CHECK((*layout)->bodies.size() == 2);
  }
  // Names without text, and ones that are not UTF-8.
  ModelDef model = small_model();
  model.bodies[1].bones[0].name = "";
  model.bodies[0].name = "\xff";
  const auto layout = find_driver("natnet")->make_layout(
      natnet::encode_description(model, {3, 0}, {.version = {3, 0}}));
  REQUIRE(layout);
  CHECK((*layout)->bodies[0].name == "\\xff");
  CHECK((*layout)->bodies[1].name == "rigid body 2");
}

TEST_CASE("any description of NatNet is refused or becomes bodies") {
  std::mt19937 random(29);
  const NatNetBytes good = natnet::encode_description(small_model(), {3, 0}, {.version = {3, 0}});
  for (int round = 0; round < 3000; ++round) {
    NatNetBytes bad = good;
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    }
    const auto layout = find_driver("natnet")->make_layout(bad);
    if (!layout) CHECK_FALSE(layout.error().message.empty());
  }
}

}  // namespace posed::drivers
