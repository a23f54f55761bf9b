// Sony mocopi: its datagrams, byte by byte, the skeleton that it sends, frames and damage.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <random>

#include "drivers/driver.hpp"
#include "drivers/mocopi/emulator.hpp"
#include "drivers/mocopi/encode.hpp"
#include "drivers/mocopi/protocol.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/recorded_log.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers::mocopi {
namespace {

using mocopi::BoneEntry;
using mocopi::MocopiEmulator;
using test::CollectSink;
using Bytes = std::vector<std::byte>;
using Layout = std::unique_ptr<const SourceLayout>;

std::unique_ptr<Decoder> new_decoder() {
  const Driver& driver = *find_driver("mocopi");
  return driver.make_decoder(driver.expect({}).value()).value();
}

Bytes content_of(const Bytes& datagram) {
  mocopi::Datagram found;
  REQUIRE(mocopi::decode_datagram(datagram, found) == Outcome::kOk);
  return {found.content.begin(), found.content.end()};
}

Result<Layout> layout_of(const std::vector<BoneEntry>& bones) {
  return find_driver("mocopi")->make_layout(content_of(mocopi::encode_skeleton(bones)));
}

// A root and a bone on it, which stands in the list before it.
std::vector<BoneEntry> two_bones() {
  return {{.id = 1, .parent = 0, .transform = {kIdentity, {0, 0.5F, 0}}},
          {.id = 0, .parent = mocopi::kNoParent, .transform = {kIdentity, {0, 1, 0}}}};
}

struct Rig {
  std::unique_ptr<Decoder> decoder = new_decoder();
  Layout layout = layout_of(two_bones()).value();
  CollectSink sink;
  std::uint32_t number = 0;

  Rig() { decoder->use(*layout); }
  void feed(const std::vector<BoneEntry>& bones) {
    ++number;
    decoder->feed(mocopi::encode_frame(number, 0.02 * number, 1e9 + 0.02 * number, bones), 0, sink);
  }
};

Bytes next(MocopiEmulator& emulator) {
  Bytes bytes;
  emulator.emit(emulator.next_due_ns(), bytes);
  return bytes;
}

}  // namespace

TEST_CASE("a mocopi frame has the bytes of its description") {
  const std::vector<BoneEntry> one{{.id = 3, .parent = 0, .transform = {{0, 0, 0, 1}, {0, 0, -2}}}};
  const Bytes bytes = mocopi::encode_frame(0x01020304, 1.0, 2.0, one);
  const std::string expected =
      std::string("\x23\0\0\0head\x12\0\0\0ftypsony motion format\1\0\0\0vrsn\1", 43) +
      std::string("\x1a\0\0\0sndf\x8\0\0\0ipad\x7f\0\0\1\0\0\0\0\2\0\0\0rcvp\x3f\x30", 34) +
      std::string("\x66\0\0\0fram\4\0\0\0fnum\4\3\2\1\4\0\0\0time\0\0\x80\x3f", 32) +
      std::string("\x8\0\0\0uttm\0\0\0\0\0\0\0\x40\x36\0\0\0btrs\x2e\0\0\0btdt", 32) +
      std::string("\2\0\0\0bnid\3\0\x1c\0\0\0tran\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f", 34) +
      std::string("\0\0\0\0\0\0\0\0\0\0\0\xc0", 12);
  const std::string got(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  CHECK(got == expected);
}

TEST_CASE("mocopi's skeleton becomes a body with the bones that posed knows") {
  MocopiEmulator emulator(60.0);
  const Skeleton& skeleton = *emulator.skeleton(0);
  CHECK(skeleton.joints.size() == mocopi::kBones);
  CHECK(skeleton.joints[0].name == "root");
  for (const Bone bone : {Bone::kHips, Bone::kSpine, Bone::kHead, Bone::kLeftHand,
                          Bone::kRightLowerArm, Bone::kRightToes}) {
    CHECK(skeleton.joint_of(bone) >= 0);
  }
  CHECK(skeleton.joints[skeleton.joint_of(Bone::kLeftLowerArm)].offset_m.x() > 0.0);
  const auto layout = layout_of(two_bones()).value();
  REQUIRE(layout->bodies[0].skeleton->joints.size() == 2);
  CHECK(layout->bodies[0].skeleton->joints[1].name == "torso_1");
  CHECK(layout->bodies[0].skeleton->joints[1].offset_m.y() == Approx(0.5));
  auto bones = two_bones();
  bones[1].parent = 0;  // some say that the root is its own parent
  CHECK(layout_of(bones));
}

TEST_CASE("a wrong skeleton of mocopi is refused with a sentence that names the fault") {
  const auto refused = [](const std::vector<BoneEntry>& bones, const std::string& word) {
    const auto layout = layout_of(bones);
    REQUIRE_FALSE(layout);
    INFO(layout.error().message);
    CHECK(layout.error().message.find(word) != std::string::npos);
  };
  refused({}, "no bones");
  auto bones = two_bones();
  bones[0].parent = 9;
  refused(bones, "two roots");
  bones[1].parent = 1;
  bones[0].parent = 0;
  refused(bones, "no root");
  bones = two_bones();
  bones[0].id = 0;
  refused(bones, "twice");
  bones = two_bones();
  bones.push_back({.id = 5, .parent = 6, .transform = {}});
  bones.push_back({.id = 6, .parent = 5, .transform = {}});
  refused(bones, "circle");
  bones = two_bones();
  bones[0].transform.position_m[1] = std::nanf("");
  refused(bones, "out of the room");
  bones.clear();
  for (std::uint16_t id = 0; id <= kMaxJoints; ++id) bones.push_back({.id = id, .parent = 0});
  refused(bones, "too many");
  const Bytes whole = content_of(mocopi::encode_skeleton(two_bones()));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto layout = find_driver("mocopi")->make_layout(std::span(whole).first(size));
    if (layout) CHECK(size > whole.size());
  }
}

TEST_CASE("what the mocopi emulator sends is decoded, also when posed") {
  MocopiEmulator emulator(60.0);
  const auto decoder = new_decoder();
  CollectSink sink;
  decoder->feed(next(emulator), 0, sink);
  REQUIRE(sink.descriptions == 1);
  const auto layout = find_driver("mocopi")->make_layout(sink.described).value();
  decoder->feed(next(emulator), 0, sink);
  CHECK(sink.count(Outcome::kForeign) == 1);
  decoder->use(*layout);
  for (int i = 0; i < 10; ++i) decoder->feed(next(emulator), 0, sink);
  REQUIRE(sink.frames.size() == 10);
  CHECK(sink.frames[9].header.device_ns == Approx(9e9 / 60.0).margin(2000.0));
  Frame frame = sink.frames[9];
  frame.root_position_m = {1, 2, 3};
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    frame.rotation_xyzw[j] = from_eigen(axis_rotation(Axis::kY, 0.1 * static_cast<double>(j)));
  }
  frame.valid[4] = false;
  emulator.pose(0, frame);
  emulator.pose(1, frame);
  CHECK(emulator.skeleton(1) == nullptr);
  decoder->feed(next(emulator), 0, sink);
  const Frame& got = sink.frames[10];
  CHECK(got.skeleton == emulator.skeleton(0)->id);
  CHECK(got.root_position_m == Vec3f{1, 2, 3});
  for (std::size_t j = 0; j < frame.joint_count; ++j) {
    CHECK(got.valid[j] == (j != 4));
    if (j == 4) continue;
    CHECK(angle_between_rad(to_eigen_double(got.rotation_xyzw[j]),
                            to_eigen_double(frame.rotation_xyzw[j])) < 1e-5);
  }
}

TEST_CASE("mocopi frames that contradict the skeleton, come late or are damaged are counted") {
  Rig rig;
  rig.feed(two_bones());
  CHECK(rig.sink.frames.size() == 1);
  auto bones = two_bones();
  bones[0].id = 7;
  rig.feed(bones);
  bones[0].id = 0;
  rig.feed(bones);
  bones = two_bones();
  bones[1].transform.position_m[0] = 1e6F;
  rig.feed(bones);
  bones = two_bones();
  bones[0].transform.rotation_xyzw = {std::nanf(""), 0, 0, 1};
  rig.feed(bones);
  rig.feed({two_bones()[0]});  // without the root
  CHECK(rig.sink.count(Outcome::kOutOfRange) == 5);
  rig.feed({two_bones()[1]});
  REQUIRE(rig.sink.frames.size() == 2);
  CHECK_FALSE(rig.sink.frames[1].valid[1]);
  rig.number -= 1;
  rig.feed(two_bones());
  rig.number -= 2;
  rig.feed(two_bones());
  CHECK(rig.sink.count(Outcome::kDuplicate) == 2);
  const Bytes good = mocopi::encode_frame(50, 1, 1e9, two_bones());
  for (std::size_t size = 0; size < good.size(); ++size) {
    rig.decoder->feed(std::span(good).first(size), 0, rig.sink);
  }
  CHECK(rig.sink.frames.size() == 2);
  Bytes other = good;
  other[16] ^= std::byte{1};
  rig.decoder->feed(other, 0, rig.sink);
  CHECK(rig.sink.frames.size() == 2);
}

TEST_CASE("any bytes for mocopi's decoder: no allocation, sound frames") {
  std::mt19937 random(29);
  MocopiEmulator emulator(60.0);
  const Bytes skeleton = next(emulator), frame = next(emulator);
  const auto layout = find_driver("mocopi")->make_layout(content_of(skeleton)).value();
  const auto decoder = new_decoder();
  decoder->use(*layout);
  CollectSink sink;
  std::vector<Bytes> bad;
  for (int round = 0; round < 2000; ++round) {
    Bytes bytes = round % 4 == 0 ? skeleton : frame;
    for (int flips = 0; flips <= round % 5; ++flips) {
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    }
    bad.push_back(std::move(bytes));
  }
  const std::uint64_t before = test::allocations();
  for (const Bytes& bytes : bad) decoder->feed(bytes, 0, sink);
  CHECK(test::allocations() == before);
  bool usable = true;
  for (const Frame& one : sink.frames) usable = usable && test::is_valid(one);
  CHECK(usable);
  for (const Bytes& bytes : bad) {
    const auto other = find_driver("mocopi")->make_layout(bytes);
    if (!other) CHECK_FALSE(other.error().message.empty());
  }
}

namespace {

// A frame before the skeleton, damage, a repeated datagram.
std::string emulated_mocopi_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of the mocopi app, with damage put in.\n"
      "driver mocopi\nidentity udp 127.0.0.1:12351\ntext mocopi rate=60\n";
  MocopiEmulator emulator(60.0);
  const Bytes skeleton = next(emulator);
  text += test::recorded_row(1'000'000, "hex", next(emulator)) +
          test::recorded_row(2'000'000, "hex", skeleton) +
          test::recorded_row(2'000'000, "bodies", content_of(skeleton));
  for (int i = 1; i <= 8; ++i) {
    Bytes bytes = next(emulator);
    if (i == 3) bytes[140] = std::byte{0x7F};
    if (i == 5) bytes.resize(bytes.size() / 2);
    text += test::recorded_row(i * 16'666'667LL, "hex", bytes);
    if (i == 7) text += test::recorded_row(i * 16'666'667LL, "hex", bytes);
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated mocopi", "[.write-logs]") {
  const auto path = test::golden("devices") / "mocopi.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_mocopi_log();
}

TEST_CASE("wrong options of mocopi are refused at once") {
  const Driver& driver = *find_driver("mocopi");
  test::check_refused(driver, {{{{"listen", std::string("0.0.0.0:12351")}}, "peers"},
                               {{{"rate_hz", 0.0}}, "rate_hz"}});
  test::check_undescribed(driver, {"", "mocopi", "mocopi rate=", "mocopi rate=0"});
}

}  // namespace posed::drivers::mocopi
