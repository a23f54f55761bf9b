// The stream of another posed as a device: its messages against protobuf's own, damage, what is
// carried on.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include <google/protobuf/stubs/logging.h>

#include "drivers/chain/emulator.hpp"
#include "drivers/chain/protocol.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/message/frame_message.hpp"
#include "proto/message/skeleton_message.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers::chain {
namespace {

using test::CollectSink;
using Chunk = std::vector<std::byte>;

const char* const kStream = "walker";  // the driver's default

Chunk pose_chunk(const v1::Frame& frame) {
  return join_message(std::string("pose/") + kStream, frame.SerializeAsString());
}

// An upstream that publishes frames of a hand, and the decoder that hears it.
struct ChainRig {
  Skeleton hand = hand_skeleton(Side::kLeft);
  message::FrameEncoder encoder{kStream};
  std::unique_ptr<Decoder> decoder;
  std::unique_ptr<const SourceLayout> layout;
  CollectSink sink;

  ChainRig() {
    const Driver& driver = *find_driver("posed");
    decoder = driver.make_decoder(driver.expect({}).value()).value();
  }
  void describe() {
    const auto message = message::skeleton_message(kStream, hand, 100.0);
    decoder->feed(join_message(std::string("skeleton/") + kStream, message.SerializeAsString()), 0,
                  sink);
    REQUIRE_FALSE(sink.described.empty());
    layout = find_driver("posed")->make_layout(sink.described).value();
    decoder->use(*layout);
  }
  [[nodiscard]] Frame frame(std::uint64_t sequence) const {
    HandAngles angles{};
    angles.fill(0.1 + 0.001 * static_cast<double>(sequence));
    Frame made;
    made.header.sequence = sequence;
    made.header.arrival_ns = 1'000'000'000 + static_cast<std::int64_t>(sequence) * 10'000'000;
    set_hand_angles(hand, angles, made);
    made.skeleton = hand.id;
    return made;
  }
  void feed(const Frame& frame) { decoder->feed(pose_chunk(encoder.encode(frame)), 0, sink); }
  void feed_changed(const std::function<void(v1::Frame&)>& change, std::uint64_t sequence) {
    v1::Frame message = encoder.encode(frame(sequence));
    change(message);
    decoder->feed(pose_chunk(message), 0, sink);
  }
};

TEST_CASE("a frame of another posed arrives as it was published") {
  ChainRig rig;
  rig.describe();
  REQUIRE(rig.layout->bodies.size() == 1);
  CHECK(rig.layout->bodies[0].name == kStream);
  CHECK(rig.layout->bodies[0].rate_hz == 100.0);
  CHECK(rig.layout->bodies[0].skeleton->id == rig.hand.id);
  Frame sent = rig.frame(5);
  sent.quality = Quality::kPredicted;
  sent.source = Source::kLabels;
  sent.label = {'f', 'i', 's', 't'};
  sent.timecode = to_timecode("01:02:03:04");
  sent.label_probability = 0.75F;
  sent.lag_frames = 2;
  sent.lag_ms = 20.0F;
  sent.root_position_m = {1.0F, 2.0F, 3.0F};
  sent.valid.reset(7);
  sent.rotation_xyzw[7] = kIdentity;
  rig.feed(sent);
  REQUIRE(rig.sink.frames.size() == 1);
  const Frame& got = rig.sink.frames[0];
  CHECK(got.skeleton == rig.hand.id);
  CHECK(got.joint_count == sent.joint_count);
  CHECK(got.angle_count == sent.angle_count);
  CHECK(got.valid == sent.valid);
  for (std::size_t j = 0; j < sent.joint_count; ++j) {
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK(std::abs(got.rotation_xyzw[j][k] - sent.rotation_xyzw[j][k]) <= 1.2e-7F);
    }
  }
  CHECK(got.angle_rad == sent.angle_rad);
  CHECK(got.root_position_m == sent.root_position_m);
  CHECK(got.quality == Quality::kPredicted);
  CHECK(got.source == Source::kLabels);
  CHECK(got.label == sent.label);
  CHECK(view_of(got.timecode) == "01:02:03:04");
  CHECK(got.label_probability == 0.75F);
  CHECK(got.lag_frames == 2);
  CHECK(got.lag_ms == 20.0F);
}

TEST_CASE("the upstream's clock is the device's, and its sequence the order") {
  ChainRig rig;
  rig.describe();
  for (const std::uint64_t sequence : {10, 11, 13, 12, 13, 14}) rig.feed(rig.frame(sequence));
  CHECK(rig.sink.frames.size() == 4);
  CHECK(rig.sink.count(Outcome::kLate) == 1);
  CHECK(rig.sink.count(Outcome::kDuplicate) == 1);
  const std::int64_t first_ns = rig.sink.frames[0].header.device_ns;
  CHECK(rig.sink.frames[1].header.device_ns - first_ns == 10'000'000);
  CHECK(rig.sink.frames[3].header.device_ns - first_ns == 40'000'000);
  rig.sink.clear();
  rig.feed(rig.frame(1000));
  rig.feed(rig.frame(1));  // the upstream has started again
  rig.feed(rig.frame(2));
  CHECK(rig.sink.frames.size() == 3);
}

TEST_CASE("a pose that a silent upstream repeats is no sign of life") {
  ChainRig rig;
  rig.describe();
  rig.feed(rig.frame(7));
  for (int i = 0; i < 100; ++i) {
    Frame stale = rig.frame(7);
    stale.quality = Quality::kStale;
    rig.feed(stale);
  }
  CHECK(rig.sink.frames.size() == 1);
  CHECK(rig.sink.count(Outcome::kDuplicate) == 100);
}

TEST_CASE("who connects to a silent upstream hears no frame until it speaks again") {
  ChainRig rig;
  rig.describe();
  Frame stale = rig.frame(9);
  stale.quality = Quality::kStale;
  for (int i = 0; i < 3; ++i) rig.feed(stale);
  CHECK(rig.sink.frames.empty());
  CHECK(rig.sink.count(Outcome::kDuplicate) == 3);
  rig.feed(rig.frame(10));
  CHECK(rig.sink.frames.size() == 1);
}

TEST_CASE("a skeleton of another stream than the topic says is foreign") {
  ChainRig rig;
  v1::Skeleton message = message::skeleton_message("bob", rig.hand, 100.0);
  const auto feed = [&](const std::string& body) {
    rig.decoder->feed(join_message("skeleton/walker", body), 0, rig.sink);
  };
  feed(message.SerializeAsString());
  CHECK(rig.sink.count(Outcome::kForeign) == 1);
  CHECK(rig.sink.described.empty());
  message.set_stream(kStream);
  const std::string good = message.SerializeAsString();
  feed(good + std::string("\x0A\x03"
                          "bob"));  // protobuf takes the last one of a field
  CHECK(rig.sink.count(Outcome::kForeign) == 2);
  feed(good);
  CHECK(rig.sink.count(Outcome::kForeign) == 2);
  CHECK_FALSE(rig.sink.described.empty());
}

TEST_CASE("poses without their skeleton, and other topics, are foreign") {
  ChainRig rig;
  rig.feed(rig.frame(1));
  CHECK(rig.sink.count(Outcome::kForeign) == 1);
  rig.describe();
  Frame other = rig.frame(2);
  other.skeleton = 123;
  rig.feed(other);
  for (const char* topic : {"pose/walker-raw", "pose/", "stats", "sensor/walker", ""}) {
    rig.decoder->feed(join_message(topic, rig.encoder.encode(rig.frame(3)).SerializeAsString()), 0,
                      rig.sink);
  }
  CHECK(rig.sink.count(Outcome::kForeign) == 7);
  CHECK(rig.sink.frames.empty());
  rig.decoder->feed({}, 0, rig.sink);
  rig.decoder->feed(join_message("skeleton/walker", ""), 0, rig.sink);
  CHECK(rig.sink.count(Outcome::kShort) == 2);
}

TEST_CASE("values that no pose has are out of range, one by one") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::function<void(v1::Frame&)>> damages{
      [](v1::Frame& m) { m.clear_rotation_xyzw(); },
      [](v1::Frame& m) { m.add_rotation_xyzw(1.0F); },
      [&](v1::Frame& m) { m.set_rotation_xyzw(5, nan); },
      [](v1::Frame& m) { m.set_rotation_xyzw(5, 3.0F); },
      [](v1::Frame& m) { m.mutable_validity()->push_back('\1'); },
      [](v1::Frame& m) { m.clear_validity(); },
      [](v1::Frame& m) { m.clear_root_position_m(); },
      [&](v1::Frame& m) { m.set_root_position_m(0, nan); },
      [](v1::Frame& m) { m.set_root_position_m(1, 1e4F); },
      [](v1::Frame& m) { m.add_root_position_m(1.0F); },
      [&](v1::Frame& m) { m.set_angle_rad(3, nan); },
      [](v1::Frame& m) { m.set_angle_rad(3, 1e4F); },
      [](v1::Frame& m) { m.add_angle_rad(0.0F); },
      [](v1::Frame& m) { m.mutable_angle_rad()->RemoveLast(); },
      [](v1::Frame& m) { m.set_quality(static_cast<v1::Quality>(4)); },
      [](v1::Frame& m) { m.set_source(static_cast<v1::Source>(9)); },
      [](v1::Frame& m) { m.set_label("a label that is too long"); },
      [](v1::Frame& m) { m.set_label("two words"); },
      [](v1::Frame& m) { m.set_label_probability(1.5F); },
      [&](v1::Frame& m) { m.set_label_probability(nan); },
      [](v1::Frame& m) { m.set_lag_frames(70'000); },
      [&](v1::Frame& m) { m.set_lag_ms(nan); },
      [](v1::Frame& m) { m.set_lag_ms(-1.0F); }};
  ChainRig rig;
  rig.describe();
  for (std::size_t i = 0; i < damages.size(); ++i) {
    INFO(i);
    rig.feed_changed(damages[i], 10 + i);
    CHECK(rig.sink.count(Outcome::kOutOfRange) == static_cast<int>(i) + 1);
  }
  CHECK(rig.sink.frames.empty());
  rig.feed(rig.frame(50));
  CHECK(rig.sink.frames.size() == 1);
}

TEST_CASE("an angle of a joint that was not measured may be missing") {
  ChainRig rig;
  rig.describe();
  HandAngles angles{};
  angles[0] = std::numeric_limits<double>::quiet_NaN();
  Frame sent = rig.frame(3);
  set_hand_angles(rig.hand, angles, sent);
  rig.feed(sent);
  REQUIRE(rig.sink.frames.size() == 1);
  CHECK(rig.sink.frames[0].valid == sent.valid);
  CHECK_FALSE(rig.sink.frames[0].valid.all());
}

// What protobuf's own parser finds in the same bytes.
void check_as_protobuf(const UpstreamFrame& got, const v1::Frame& expected) {
  CHECK(got.sequence == expected.sequence());
  CHECK(got.arrival_ns == expected.arrival_ns());
  CHECK(got.skeleton_id == expected.skeleton_id());
  CHECK(got.quality == static_cast<std::uint64_t>(expected.quality()));
  CHECK(got.label == expected.label());
  CHECK(got.timecode == expected.timecode());
  CHECK(got.label_probability == expected.label_probability());
  CHECK(got.lag_frames == expected.lag_frames());
  CHECK(got.lag_ms == expected.lag_ms());
  CHECK(got.validity.size() == expected.validity().size());
  const auto same = [](const auto& list, const auto& field) {
    if (!std::cmp_equal(list.count, field.size())) return false;
    return std::equal(field.begin(), field.end(), list.values.begin());
  };
  CHECK(same(got.root_position_m, expected.root_position_m()));
  CHECK(same(got.rotation_xyzw, expected.rotation_xyzw()));
  CHECK(same(got.angle_rad, expected.angle_rad()));
}

TEST_CASE("the reader finds what protobuf finds, in packed and unpacked lists") {
  std::mt19937 engine(3);
  const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
  const auto real = [&] { return static_cast<float>(random() % 1000) / 500.0F; };
  for (int round = 0; round < 300; ++round) {
    v1::Frame message;
    message.set_stream("walker");
    message.set_sequence((std::uint64_t{random()} << 32) | random());
    message.set_arrival_ns(-static_cast<std::int64_t>(random()));
    message.set_device_ns(random());
    message.set_skeleton_id(random());
    for (int i = 0; i < 3; ++i) message.add_root_position_m(real());
    for (unsigned i = random() % 97 * 4; i > 0; --i) message.add_rotation_xyzw(real());
    for (unsigned i = random() % 289; i > 0; --i) message.add_angle_rad(real());
    message.mutable_validity()->assign(random() % 97, '\1');
    message.set_quality(static_cast<v1::Quality>(random() % 4));
    if (random() % 2 == 0) message.set_label("fist");
    if (random() % 2 == 0) message.set_timecode("10:20:30.400");
    message.set_label_probability(real());
    message.set_lag_frames(random());
    message.set_lag_ms(real());
    message.set_published_ns(random());
    std::string bytes = message.SerializeAsString();
    if (round % 3 ==
        0) {  // numbers one by one, as proto2 wrote them, and fields of a later version
      bytes += std::string("\x45\0\0\0\0", 5);
      message.add_root_position_m(0.0F);
      bytes += std::string("\xC2\x3E\x01x", 4);
    }
    UpstreamFrame frame;
    const Outcome outcome = read_frame(std::as_bytes(std::span(bytes)), frame);
    if (round % 3 == 0) {
      CHECK(outcome == Outcome::kOutOfRange);  // a fourth coordinate does not fit
      continue;
    }
    REQUIRE(outcome == Outcome::kOk);
    check_as_protobuf(frame, message);
  }
}

TEST_CASE("whatever the bytes are, the reader accepts nothing that protobuf refuses") {
  const google::protobuf::LogSilencer silent;
  std::mt19937 engine(5);
  const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
  ChainRig rig;
  const std::string good = rig.encoder.encode(rig.frame(1)).SerializeAsString();
  int read = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string bytes = good;
    for (unsigned flips = 1 + random() % 3; flips > 0; --flips) {
      bytes[random() % std::min<std::size_t>(bytes.size(), 40)] = static_cast<char>(random());
    }
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    UpstreamFrame frame;
    if (read_frame(std::as_bytes(std::span(bytes)), frame) != Outcome::kOk) continue;
    v1::Frame expected;
    // protobuf also refuses text that is not UTF-8, which no field here keeps
    if (!expected.ParsePartialFromString(bytes)) continue;
    CHECK(frame.sequence == expected.sequence());
    CHECK(std::cmp_equal(frame.rotation_xyzw.count, expected.rotation_xyzw_size()));
    ++read;
  }
  CHECK(read > 100);
}

TEST_CASE("wrong options of posed are refused at once") {
  const Driver& driver = *find_driver("posed");
  for (const Options& options :
       {Options{{"connect", std::string("192.168.1.5:5570")}},
        Options{{"stream", std::string("Ann")}}, Options{{"stream", std::string()}},
        Options{{"rate_hz", 0.0}}, Options{{"key", std::string("/nonexistent.key")}}}) {
    const auto expected = driver.expect(options);
    REQUIRE_FALSE(expected);
    CHECK(expected.error().exit_code == ExitCode::kWrongUse);
  }
  CHECK_FALSE(driver.expect(
      {{"key", std::string("/nonexistent.key")}, {"server_key", std::string("/nonexistent.pub")}}));
  test::check_undescribed(
      driver, {"", "posed stream=ann", "posed stream=ann rate=", "posed stream=ann rate=0",
               "posed stream=A rate=60", "posed stream= rate=60"});
  const auto again = driver.describe("posed stream=ann rate=60", "tcp://127.0.0.1:5570");
  REQUIRE(again);
  CHECK(again->rate_hz == 60.0);
}

TEST_CASE("descriptions that are none are refused") {
  CHECK_FALSE(
      find_driver("posed")->make_layout(std::as_bytes(std::span(std::string_view("\xFF\xFF")))));
  CHECK_FALSE(find_driver("posed")->make_layout({}));
  v1::Skeleton message = message::skeleton_message("ann", hand_skeleton(Side::kLeft), 60.0);
  message.set_stream("../ann");
  const std::string bytes = message.SerializeAsString();
  CHECK_FALSE(find_driver("posed")->make_layout(std::as_bytes(std::span(bytes))));
}

std::string emulated_posed_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of another posed, with damage put in.\n"
      "driver posed\nidentity tcp://127.0.0.1:5570\ntext posed stream=walker rate=60\n";
  UpstreamEmulator emulator({.stream = kStream, .rate_hz = 60.0});
  const auto row = [&](int i, const char* kind, std::span<const std::byte> bytes) {
    text += "at " + std::to_string(1'000'000 + i * 16'666'667LL) + " " + kind;
    for (const std::byte byte : bytes) {
      std::array<char, 4> hex{};
      (void)std::snprintf(hex.data(), hex.size(), " %02x", std::to_integer<unsigned>(byte));
      text += hex.data();
    }
    text += '\n';
  };
  for (int i = 0; i < 12; ++i) {
    Chunk bytes;
    emulator.emit(emulator.next_due_ns(), bytes);
    if (i == 4) std::fill_n(&bytes[bytes.size() / 2], 4, std::byte{0x7F});
    if (i == 6) bytes.resize(bytes.size() / 2);
    row(i, "hex", bytes);
    UpstreamMessage message;
    REQUIRE((i == 6 || split_message(bytes, message)));
    if (i == 0) row(i, "bodies", message.body);
    if (i == 8) row(i, "hex", bytes);  // twice
  }
  return text;
}

}  // namespace

TEST_CASE("write the log of the emulated posed", "[.write-logs]") {
  const auto path = test::golden("devices") / "posed.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_posed_log();
}

}  // namespace posed::drivers::chain
