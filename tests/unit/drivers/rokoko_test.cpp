// Rokoko Studio: its frames in versions 2, 2.5 and 3, the bodies that they become, the T-pose, and
// bodies that come, go and change.
#include <catch2/catch.hpp>

#include <fstream>
#include <sstream>

#include "drivers/driver.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/recorded_log.hpp"

namespace posed::drivers::rokoko {
namespace {

using rokoko::StudioEmulator;
using rokoko::StudioVersion;
using test::CollectSink;
using Bytes = std::vector<std::byte>;

// A decoder that has the bodies of its first datagram from the start.
struct Studio : test::DecoderRig {
  Studio() : DecoderRig("rokoko") {}

  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns = 0) {
    if (layouts.empty()) {
      CollectSink first(0);
      test::decoder_of(driver)->feed(bytes, 0, first);
      if (first.descriptions > 0) use(first.described);
    }
    DecoderRig::feed(bytes, arrival_ns);
  }
  void feed(const std::string& json, std::int64_t arrival_ns = 0) {
    feed(std::as_bytes(std::span(json)), arrival_ns);
  }
  [[nodiscard]] const Body& body(const std::string& name) const {
    const auto at = std::ranges::find(bodies(), name, &Body::name);
    REQUIRE(at != bodies().end());
    return *at;
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const Body& body : bodies()) names.push_back(body.name);
    return names;
  }
};

struct Streaming {
  StudioEmulator emulator;
  Studio studio;
  explicit Streaming(rokoko::StudioEmulatorSettings settings = {}) : emulator(settings) {}

  Bytes next() {
    Bytes bytes;
    emulator.emit(emulator.next_due_ns(), bytes);
    return bytes;
  }
  void step(int frames = 1) {
    for (int i = 0; i < frames; ++i) {
      const std::int64_t arrival_ns = emulator.next_due_ns();
      studio.feed(next(), arrival_ns);
    }
  }
};

// "x y z  x y z w" of a joint, in Unity's axes.
std::string joint(const std::string& name, const std::string& numbers) {
  std::istringstream words(numbers);
  std::array<std::string, 7> n;
  for (std::string& word : n) words >> word;
  return '"' + name + R"(":{"position":{"x":)" + n[0] + R"(,"y":)" + n[1] + R"(,"z":)" + n[2] +
         R"(},"rotation":{"x":)" + n[3] + R"(,"y":)" + n[4] + R"(,"z":)" + n[5] + R"(,"w":)" +
         n[6] + "}}";
}

std::string v3(double time_s, const std::string& actors, const std::string& props = "") {
  return "{\"version\":3,\"scene\":{\"timestamp\":" + std::to_string(time_s) + ",\"actors\":[" +
         actors + "],\"props\":[" + props + "]}}";
}

std::string actor(const std::string& body, const std::string& name = "Anna") {
  return "{\"name\":\"" + name + "\",\"body\":{" + body + "}}";
}

const std::string kHip = joint("hip", "1 2 3 0 0 0 1");
const std::string kSpine = joint("spine", "1 2.5 3 0 0 1 0");

}  // namespace

TEST_CASE("Studio's joints are mirrored into posed's axes and made relative to the parent") {
  Studio studio;
  studio.feed(v3(1, actor(kHip + "," + joint("spine", "1 2.5 3 0.5 0.5 0.5 0.5"))));
  REQUIRE(studio.sink.frames.size() == 1);
  const Frame& frame = studio.sink.frames[0];
  CHECK(frame.root_position_m == Vec3f{-1, 2, 3});
  CHECK(frame.rotation_xyzw[0] == kIdentity);
  CHECK(frame.rotation_xyzw[1] == Quatf{0.5F, -0.5F, -0.5F, 0.5F});
  CHECK(frame.header.device_ns == 0);
  const Skeleton& skeleton = *studio.body("Anna").skeleton;
  REQUIRE(skeleton.joints.size() == 2);
  CHECK(skeleton.joints[1].name == "spine");
  CHECK(skeleton.joints[1].bone == Bone::kSpine);
  CHECK(skeleton.joints[1].offset_m.isApprox(Eigen::Vector3d(0, 0.5, 0), 1e-6));
}

TEST_CASE("Studio's T-pose is the canonical one: every bone lies along its axis, nothing turns") {
  Streaming streaming;
  const Skeleton& person = *streaming.emulator.skeleton(0);
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(person.joints.size());
  frame.valid.set();
  frame.root_position_m = {0, 1, 0};
  for (std::size_t j = 0; j < person.joints.size(); ++j) {
    const Joint& one = person.joints[j];
    frame.rotation_xyzw[j] = from_eigen(
        one.parent < 0 ? one.T_world_joint
                       : person.joints[one.parent].T_world_joint.conjugate() * one.T_world_joint);
  }
  streaming.emulator.pose(0, frame);
  streaming.step();
  REQUIRE(streaming.studio.sink.frames.size() == 3);
  const Frame& got = streaming.studio.sink.frames[0];
  const Skeleton& skeleton = *streaming.studio.body("Anna").skeleton;
  REQUIRE(skeleton.joints.size() == rokoko::kStudioJoints);
  std::vector<Eigen::Quaterniond> global;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& one = skeleton.joints[j];
    const Eigen::Quaterniond local = to_eigen_double(got.rotation_xyzw[j]);
    global.push_back(one.parent < 0 ? local : global[static_cast<std::size_t>(one.parent)] * local);
    const Eigen::Quaterniond T_parent =
        one.parent < 0 ? Eigen::Quaterniond::Identity() : skeleton.joints[one.parent].T_world_joint;
    const Eigen::Quaterniond canonical = T_parent * local * one.T_world_joint.conjugate();
    INFO(one.name);
    CHECK(angle_between_rad(canonical, Eigen::Quaterniond::Identity()) < 1e-5);
    // In Studio a bone lies along its own -Y; only so do its references fit the figure.
    const Eigen::Vector3d along = global.back() * -Eigen::Vector3d::UnitY();
    if (one.name.starts_with("leftLowerArm")) CHECK(along.x() > 0.999);
    if (one.name.starts_with("rightLowerArm")) CHECK(along.x() < -0.999);
    if (one.name == "spine" || one.name == "neck") CHECK(along.y() > 0.999);
    if (one.name == "leftLeg" || one.name == "rightUpLeg") CHECK(along.y() < -0.999);
    if (one.name == "leftToe" || one.name == "rightToe") CHECK(along.z() > 0.999);
  }
}

TEST_CASE("what is emulated is decoded: version 2, 2.5 and 3, plain and compressed") {
  for (const StudioVersion version : {StudioVersion::k2, StudioVersion::k25, StudioVersion::k3}) {
    for (const bool lz4 : {false, true}) {
      Streaming streaming({.rate_hz = 60.0, .version = version, .lz4 = lz4});
      streaming.step(10);
      const CollectSink& sink = streaming.studio.sink;
      CHECK(streaming.studio.names() == std::vector<std::string>{"Anna", "Ben", "Sword"});
      CHECK(sink.count(Outcome::kOk) == 10);
      CHECK(sink.descriptions == 1);
      REQUIRE(sink.frames.size() == 30);
      REQUIRE(sink.samples.size() == 10);
      CHECK(sink.sample_bodies[0] == 0);
      for (std::size_t body = 0; body < 3; ++body) {
        const Skeleton& wanted = *streaming.emulator.skeleton(body);
        const Skeleton& got = *streaming.studio.layouts.back()->bodies[body].skeleton;
        REQUIRE(got.joints.size() == wanted.joints.size());
        for (std::size_t j = 0; j < got.joints.size(); ++j) {
          CHECK(got.joints[j].name == wanted.joints[j].name);
          CHECK((got.joints[j].offset_m - wanted.joints[j].offset_m).norm() < 1e-5);
        }
      }
      CHECK(sink.frames[27].header.device_ns == Approx(9e9 / 60.0).margin(100.0));
      const auto& names = streaming.studio.body("Anna").samples.names;
      const auto jaw = std::ranges::find(names, "jawOpen") - names.begin();
      CHECK(sink.samples[0].value[static_cast<std::size_t>(jaw)] == Approx(0.5));
      CHECK(sink.samples[0].value_count == rokoko::kFaceValues);
    }
  }
}

TEST_CASE("Studio's frames before their bodies are in use are counted and not emitted") {
  CollectSink sink;
  const auto decoder = test::decoder_of(*find_driver("rokoko"));
  const std::string first = v3(1, actor(kHip)), second = v3(2, actor(kHip));
  decoder->feed(std::as_bytes(std::span(first)), 0, sink);
  CHECK(sink.descriptions == 1);
  decoder->feed(std::as_bytes(std::span(second)), 0, sink);
  CHECK(sink.descriptions == 1);
  CHECK(sink.frames.empty());
  CHECK(sink.count(Outcome::kForeign) == 2);
}

TEST_CASE("a posed Studio emulator streams that pose") {
  Streaming streaming;
  const Skeleton& ben = *streaming.emulator.skeleton(1);
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(ben.joints.size());
  frame.valid.set();
  frame.root_position_m = {0.25F, 1.5F, -2.0F};
  for (std::size_t j = 0; j < ben.joints.size(); ++j) {
    frame.rotation_xyzw[j] =
        from_eigen(axis_rotation(static_cast<Axis>(j % 3), 0.1 * static_cast<double>(j)));
  }
  frame.valid[4] = false;
  streaming.emulator.pose(1, frame);
  streaming.emulator.pose(7, frame);
  CHECK(streaming.emulator.skeleton(7) == nullptr);
  streaming.step();
  const Skeleton& got = *streaming.studio.body("Ben").skeleton;
  CHECK(got.joints.size() == ben.joints.size() - 1);  // the head was never seen
  const Frame& seen = streaming.studio.sink.frames[1];
  CHECK(seen.root_position_m == frame.root_position_m);
  for (std::size_t j = 0; j < got.joints.size(); ++j) {
    const int from = ben.joint_index(got.joints[j].name);
    const auto wanted = frame.rotation_xyzw[static_cast<std::size_t>(from)];
    CHECK(angle_between_rad(to_eigen_double(seen.rotation_xyzw[j]), to_eigen_double(wanted)) <
          1e-5);
  }
}

TEST_CASE("without a glove the fingers are left out; hands without a body are bodies") {
  Streaming streaming;
  streaming.step();
  CHECK(streaming.studio.body("Anna").skeleton->joints.size() == 63);
  CHECK(streaming.studio.body("Ben").skeleton->joints.size() == 23);
  streaming.emulator.set_gloves_only(true);
  streaming.step(90);
  const auto names = streaming.studio.names();
  CHECK(std::ranges::count(names, "Anna left hand") == 1);
  CHECK(std::ranges::count(names, "Anna right hand") == 1);
  CHECK(streaming.studio.body("Anna").skeleton == nullptr);  // only her face is left
  CHECK(streaming.studio.body("Anna").samples.names.size() == rokoko::kFaceValues);
  const Skeleton& hand = *streaming.studio.body("Anna right hand").skeleton;
  CHECK(hand.joints.size() == 21);
  CHECK(hand.joints[0].name == "rightHand");
  CHECK(hand.joint_of(Bone::kRightLittleDistal) > 0);
  CHECK(streaming.studio.sink.count(Outcome::kOutOfRange) == 0);
}

TEST_CASE("Studio's bodies come and go, and others go on unchanged") {
  Streaming streaming;
  streaming.step(10);
  const std::uint32_t ben = streaming.studio.body("Ben").skeleton->id;
  streaming.emulator.set_present(0, false);
  streaming.step(90);
  CHECK(streaming.studio.names() == std::vector<std::string>{"Ben", "Sword"});
  CHECK(streaming.studio.body("Ben").skeleton->id == ben);
  streaming.emulator.set_present(0, true);
  streaming.step(30);
  CHECK(streaming.studio.names().size() == 3);
  CHECK(streaming.studio.body("Ben").skeleton->id == ben);
  CHECK(streaming.studio.sink.descriptions == 3);
}

TEST_CASE("a short glitch changes no skeleton, other proportions do after a second") {
  Studio studio;
  const auto at = [&](int frame, double spine_y) {
    const std::string spine = joint("spine", "1 " + std::to_string(spine_y) + " 3 0 0 1 0");
    studio.feed(v3(frame / 100.0, actor(kHip + "," + spine)), frame * 10'000'000LL);
  };
  int frame = 0;
  for (; frame < 50; ++frame) at(frame, 2.5 + 0.004 * (frame % 2));
  for (; frame < 100; ++frame) at(frame, 2.6);
  for (; frame < 150; ++frame) at(frame, 2.5);
  CHECK(studio.sink.descriptions == 1);
  for (; frame < 300; ++frame) at(frame, 2.6);
  CHECK(studio.sink.descriptions == 2);
  CHECK(studio.body("Anna").skeleton->joints[1].offset_m.y() == Approx(0.6));
  CHECK(studio.sink.frames.size() == 300);
}

TEST_CASE("a flood of new bodies is described at most four times a second") {
  Studio studio;
  for (int frame = 0; frame < 200; ++frame) {
    studio.feed(v3(frame / 100.0, actor(kHip, "Actor " + std::to_string(frame))),
                frame * 10'000'000LL);
  }
  CHECK(studio.sink.descriptions <= 9);
  CHECK(studio.layouts.back()->bodies.size() == kMaxBodies);
  CHECK(studio.sink.count(Outcome::kOutOfRange) > 0);  // there was no room for more
}

TEST_CASE("a missing joint is not valid, and its children keep their places") {
  Studio studio;
  const std::string chest = joint("chest", "1 3 3 0 0.6 0 0.8");
  studio.feed(v3(1, actor(kHip + "," + kSpine + "," + chest)));
  studio.feed(v3(1.1, actor(kHip + "," + chest)));
  studio.feed(v3(1.2, actor(kHip + "," + joint("spine", "1 2.5 3 0 0 0 0") + "," + chest)));
  studio.feed(v3(1.3, actor(kSpine + "," + chest)));  // no hip: nobody knows where she is
  REQUIRE(studio.sink.frames.size() == 3);
  for (const std::size_t i : {1U, 2U}) {
    const Frame& frame = studio.sink.frames[i];
    CHECK(frame.valid[0]);
    CHECK_FALSE(frame.valid[1]);
    CHECK(frame.rotation_xyzw[1] == kIdentity);
    CHECK(frame.rotation_xyzw[2][1] == Approx(-0.6F));
  }
  CHECK(studio.sink.count(Outcome::kOutOfRange) == 1);
}

TEST_CASE("Studio's frames that are late, repeated, or of a loop") {
  Studio studio;
  const auto outcome_at = [&](double time_s) {
    studio.sink.outcomes.fill(0);
    studio.feed(v3(time_s, actor(kHip)));
    const auto at = std::ranges::find(studio.sink.outcomes, 1) - studio.sink.outcomes.begin();
    return static_cast<Outcome>(at);
  };
  CHECK(outcome_at(10.00) == Outcome::kOk);
  CHECK(outcome_at(10.02) == Outcome::kOk);
  CHECK(outcome_at(10.01) == Outcome::kLate);
  CHECK(outcome_at(10.02) == Outcome::kDuplicate);
  CHECK(outcome_at(10.04) == Outcome::kOk);
  CHECK(outcome_at(0.0) == Outcome::kOk);  // the recording plays again
  CHECK(outcome_at(0.02) == Outcome::kOk);
  CHECK(outcome_at(1e6) == Outcome::kOk);  // somebody moved the playhead
  const auto& frames = studio.sink.frames;
  REQUIRE(frames.size() == 6);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    CHECK(frames[i].header.device_ns == Approx(static_cast<double>(i) * 2e7).margin(10.0));
  }
  Studio timeless;
  timeless.feed("{\"version\":2,\"actors\":[{\"name\":\"A\"," + kHip + "}]}");
  REQUIRE(timeless.sink.frames.size() == 1);
  CHECK(timeless.sink.frames[0].header.device_ns == kNoTime_ns);
}

TEST_CASE("people of JSON v4 are told once, and an empty scene is no fault") {
  const auto decoder = test::decoder_of(*find_driver("rokoko"));
  CollectSink sink(0);
  int second = 0;
  const auto feed = [&](const std::string& lists) {
    const std::string json = R"({"version":"3,0","fps":30.0,"scene":{"timestamp":)" +
                             std::to_string(++second) + R"(,"actors":[],)" + lists +
                             R"("props":[]}})";
    decoder->feed(std::as_bytes(std::span(json)), 0, sink);
  };
  feed(R"("newtons":[],"characters":[],)");
  CHECK(sink.count(Outcome::kOk) == 1);
  CHECK(sink.descriptions == 0);
  // The shape of a real frame (README of github.com/hit-wsw/hit-dex).
  const std::string joint =
      R"({"name":"LeftHand","parent":40,"position":{"x":-0.4,"y":1.3,"z":0.2},)"
      R"("rotation":{"x":-0.1,"y":-0.7,"z":0.6,"w":-0.4}})";
  for (const std::string list : {"newtons", "characters"}) {
    feed('"' + list + R"(":[{"name":"man","joints":[)" + joint + "]}],");
  }
  CHECK(sink.frames.empty());
  CHECK(sink.descriptions == 1);
  const auto layout = find_driver("rokoko")->make_layout(sink.described);
  REQUIRE_FALSE(layout);
  CHECK(layout.error().message.find("choose JSON v3") != std::string::npos);
}

TEST_CASE("an actor that makes no sense is counted, and those beside it are kept") {
  const std::string good = actor(kHip, "Ben");
  const auto bad = [&](const std::string& one) {
    Studio studio;
    studio.feed(v3(1, one + "," + good));
    INFO(one);
    CHECK(studio.sink.frames.size() == 1);
    CHECK(studio.names() == std::vector<std::string>{"Ben"});
    CHECK(studio.sink.count(Outcome::kOutOfRange) == 1);
  };
  bad(actor(joint("hip", "1001 0 0 0 0 0 1")));
  bad(actor(joint("hip", "0 0 0 0 0 0 2")));
  bad(actor(kHip + "," + kHip));
  for (const char* number : {"NaN", "\"NaN\"", "-Infinity", "Infinity", "1e999", "1e300"}) {
    bad(actor("\"hip\":{\"position\":{\"x\":" + std::string(number) +
              ",\"y\":0,\"z\":0},\"rotation\":{\"x\":0,\"y\":0,\"z\":0,\"w\":1}}"));
  }
  Studio studio;
  studio.feed(v3(1, good + "," + good));
  CHECK(studio.names() == std::vector<std::string>{"Ben", "Ben 2"});
  CHECK(studio.sink.bodies == std::vector<std::size_t>{0, 1});
}

TEST_CASE("Studio's names: the same twice, escapes, no UTF-8, none, too long") {
  Studio studio;
  const std::string prop =
      "\"position\":{\"x\":0,\"y\":0,\"z\":0},"
      "\"rotation\":{\"x\":0,\"y\":0,\"z\":0,\"w\":1}}";
  studio.feed(v3(1,
                 actor(kHip) + "," + actor(kHip, "J\\u00f8rn \\\"J\\\"") + "," +
                     actor(kHip, "\xff") + "," + actor(kHip, "") + "," +
                     actor(kHip, std::string(63, 'x') + "\xc3\xb8y"),
                 "{\"name\":\"Anna\"," + prop));
  CHECK(studio.names() == std::vector<std::string>{"Anna", "J\xc3\xb8rn \"J\"", "\\xff", "unnamed",
                                                   std::string(63, 'x'), "Anna 2"});
  CHECK(studio.sink.frames.size() == 6);
}

namespace {

// Frames before the description is in use, damage, a repeated frame, the prop that leaves, a loop.
std::string emulated_studio_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of Rokoko Studio, with damage put in.\n"
      "driver rokoko\nidentity udp 127.0.0.1:14043\ntext rokoko rate=2\n";
  Streaming streaming({.rate_hz = 2.0});
  streaming.studio.feed(streaming.next());
  for (int i = 1; i <= 8; ++i) {
    const std::int64_t at_ns = i * 500'000'000LL;
    if (i == 6) streaming.emulator.set_present(2, false);
    if (i == 7) streaming.emulator.restart();
    Bytes bytes = streaming.next();
    if (i == 3) bytes[7] ^= std::byte{0x10};
    if (i == 4) bytes.resize(bytes.size() / 2);
    text += test::recorded_row(at_ns, "hex", bytes);
    if (i == 1) text += test::recorded_row(at_ns, "bodies", streaming.studio.sink.described);
    if (i == 5) text += test::recorded_row(at_ns, "hex", bytes);
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated Studio", "[.write-logs]") {
  const auto path = test::golden("devices") / "rokoko.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_studio_log();
}

}  // namespace posed::drivers::rokoko
