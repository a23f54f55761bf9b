// CyberGlove: bytes, angles and clocks; real joint angles converted back into its bytes.
#include <poll.h>

#include <catch2/catch.hpp>

#include <cmath>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/cyberglove/decoder.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/grasps.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/cyberglove_rig.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers::cyberglove {
namespace {

using test::CollectSink;

// A serial line from a glove to a decoder.
class Line {
 public:
  Line() {
    TransportFactory ports;
    auto link = ports.serial({.port = terminal_.port()});
    if (!link) FAIL(link.error().text());
    transport_ = make_link_transport(std::move(*link));
    REQUIRE(transport_->start(0));
  }
  // Carries all bytes, in whatever pieces they arrive.
  void carry(const Emulator::Bytes& bytes, Decoder& decoder, Sink& sink) {
    terminal_.say(text_of(bytes));
    for (std::size_t came = 0; came < bytes.size();) {
      pollfd wanted{.fd = transport_->poll_fd(), .events = POLLIN, .revents = 0};
      REQUIRE(::poll(&wanted, 1, 10'000) == 1);
      const Chunk chunk = transport_->read(0);
      REQUIRE_FALSE(chunk.lost);
      decoder.feed(chunk.bytes, 0, sink);
      came += chunk.bytes.size();
    }
  }

 private:
  test::PseudoTerminal terminal_;
  std::unique_ptr<Transport> transport_;
};

// Radians per count, with the sign.
double count_rad(const glove::Model& model, std::size_t sensor) {
  const glove::Curve& line = model.sensors[sensor].curve;
  return (static_cast<double>(line.value[1]) - static_cast<double>(line.value[0])) /
         (static_cast<double>(line.raw[1]) - static_cast<double>(line.raw[0]));
}

// The counts that a glove with the default gains sends for these angles.
Raw counts_of(Raw angles, const glove::Model& model) {
  uncompute_angles(Side::kRight, angles);
  Raw raw{};
  for (std::size_t i = 0; i < kSensors; ++i) {
    const double zero = static_cast<double>(model.sensors[i].curve.raw[0]);
    raw[i] = zero + angles[i] / count_rad(model, i);
  }
  return raw;
}

double distal(double pip) { return std::copysign(std::abs(0.32 * pip * pip + 0.17 * pip), pip); }

}  // namespace

TEST_CASE("a CyberGlove's masks have the sensors that its gloves have") {
  CHECK(std::popcount(kMask18) == 18);
  CHECK(std::popcount(kMask22) == 22);
  CHECK((kMask18 & ~kMask22) == 0);
  for (const std::size_t dip : {kIndexDip, kMiddleDip, kRingDip, kLittleDip}) {
    CHECK((kMask18 >> dip & 1) == 0);
    CHECK((kMask22 >> dip & 1) == 1);
  }
  CHECK((kMask22 >> kIndexAbd & 1) == 0);
}

TEST_CASE("real joint angles come back from a CyberGlove's bytes on a pseudo-terminal") {
  const auto folder = test::shared("data/gloves/graspdb14_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  const auto model = glove_model(Side::kRight);
  REQUIRE(model);
  const Layout layout{.mask = kMask18, .time = true, .status = true};
  std::size_t frames = 0, beyond = 0;  // angles that a glove of the usual zeros cannot send
  double worst_counts = 0.0;
  double worst_distal = 0.0;
  for (const auto& file : std::filesystem::directory_iterator(*folder)) {
    const auto emulator = emulator_of({.mask = kMask18});
    const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout, .ticks = 1920});
    (void)notify(*emulator, "u 1\rd 1\rt 1920 1\rS");
    Line line;
    for (const Raw& angles : test::read_grasp_rows(file.path())) {
      const Raw counts = counts_of(angles, *model);
      emulator->set_raw(counts);
      CollectSink sink(1);
      line.carry(next(*emulator), *decoder, sink);
      REQUIRE(sink.samples.size() == 1);
      const Sample& sample = sink.samples[0];
      ++frames;
      for (std::size_t i = 0; i < kSensors; ++i) {
        REQUIRE(sample.valid[i]);
        if (counts[i] < 0.0 || counts[i] > 255.0) {
          ++beyond;
          continue;
        }
        const double difference = static_cast<double>(sample.value[i]) - angles[i];
        worst_counts = std::max(worst_counts, std::abs(difference / count_rad(*model, i)));
      }
      for (const std::size_t dip : {kIndexDip, kMiddleDip, kRingDip, kLittleDip}) {
        const double difference = static_cast<double>(sample.value[dip]) - angles[dip];
        worst_distal = std::max(worst_distal, std::abs(difference));
      }
    }
  }
  WARN(frames << " real frames: at worst " << worst_counts << " counts and, distal joints, "
              << worst_distal << " rad");
  CHECK(frames > 8000);
  CHECK(beyond < frames / 4);  // of kSensors * frames
  CHECK(worst_counts < 0.5001);
  CHECK(worst_distal < 1e-5);
}

TEST_CASE("an 18-sensor CyberGlove's distal joints are computed, a 22's are measured") {
  for (const std::uint32_t mask : {kMask18, kMask22}) {
    const auto emulator = emulator_of({.mask = mask});
    const auto decoder = decoder_of(
        {.hand = Side::kRight, .layout = {.mask = mask, .time = false, .status = false}});
    (void)notify(*emulator, plain_start());
    emulator->set_raw(some_raw());
    CollectSink sink;
    decoder->feed(next(*emulator), 0, sink);
    REQUIRE(sink.samples.size() == 1);
    const Sample& sample = sink.samples[0];
    for (std::size_t i = 0; i < kSensors; ++i) CHECK(sample.valid[i]);
    for (std::size_t i = 0; i < kSensors; ++i) {
      CHECK(sample.valid[kSensors + i] == ((mask >> i & 1) != 0));
      if (sample.valid[kSensors + i]) {
        CHECK(static_cast<double>(sample.value[kSensors + i]) == some_raw()[i]);
      }
    }
    const double pip = static_cast<double>(sample.value[kIndexPip]);
    const bool computed = static_cast<double>(sample.value[kIndexDip]) == Approx(distal(pip));
    CHECK(computed == (mask == kMask18));
    CHECK_FALSE(sample.valid[2 * kSensors]);  // no status byte: switch and light are not known
  }
}

TEST_CASE("abductions of a CyberGlove are relative, and a left hand's are mirrored") {
  std::array<float, kSensors> right{};
  right[kMiddleAbd] = 0.3F;
  right[kRingAbd] = -0.1F;
  right[kLittleAbd] = -0.2F;
  right[kThumbRoll] = 0.9F;
  right[kThumbAbd] = -0.4F;
  right[kWristYaw] = 0.1F;
  auto left = right;
  Valid valid = kMask22;
  compute_angles(0.25F, Side::kRight, kMask22, right, valid);
  CHECK(valid[kIndexAbd]);
  CHECK(right[kMiddleAbd] == Approx(-0.05));
  CHECK(right[kIndexAbd] == Approx(0.25));
  CHECK(right[kRingAbd] == Approx(-0.15));
  CHECK(right[kLittleAbd] == Approx(-0.35));
  CHECK(right[kThumbRoll] == 0.5F);
  compute_angles(0.25F, Side::kLeft, kMask22, left, valid);
  for (const std::size_t i : {kThumbAbd, kIndexAbd, kMiddleAbd, kRingAbd, kLittleAbd, kWristYaw}) {
    CHECK(left[i] == -right[i]);
  }
  CHECK(left[kThumbRoll] == right[kThumbRoll]);
  valid = kMask22;
  valid[kRingAbd] = false;
  compute_angles(0.25F, Side::kRight, kMask22, right, valid);
  for (const std::size_t i : {kIndexAbd, kMiddleAbd, kRingAbd, kLittleAbd}) CHECK_FALSE(valid[i]);
}

TEST_CASE("a pose given to the CyberGlove's emulator comes out of the decoder, either hand") {
  for (const Side hand : {Side::kRight, Side::kLeft}) {
    const auto emulator = emulator_of({.hand = hand});
    const auto decoder = decoder_of({.hand = hand, .layout = kPlain22});
    (void)notify(*emulator, plain_start());
    // The middle finger's own spread is computed from its neighbours'.
    constexpr double kIndex = 0.2, kRing = 0.1, kBias = 0.248;
    constexpr double kMiddle = -kBias * (kIndex - kRing) / (1.0 - 2.0 * kBias);
    HandAngles pose{};
    for (std::size_t f = 0; f < kFingers; ++f) {
      for (std::size_t j = f == 0 ? 1 : 0; j < kFingerJoints; ++j) {
        pose[f * kFingerChannels + 3 * j] = 0.3 + 0.1 * static_cast<double>(f + j);
      }
    }
    pose[1] = 0.4;  // thumb away from the palm
    pose[2] = 0.5;  // and rolled
    pose[kFingerChannels + 1] = kIndex;
    pose[3 * kFingerChannels + 1] = kRing;
    pose[4 * kFingerChannels + 1] = 0.25;
    pose[2 * kFingerChannels + 1] = kMiddle;
    emulator->pose(0, drivers::glove::hand_frame(pose));
    CollectSink sink;
    decoder->feed(next(*emulator), 0, sink);
    REQUIRE(sink.frames.size() == 1);
    const HandAngles got = hand_angles(sink.frames[0]);
    for (std::size_t c = 0; c < got.size(); ++c) {
      INFO("channel " << c);
      CHECK(got[c] == Approx(pose[c]).margin(0.03));
    }
  }
}

TEST_CASE("an 8-bit sample is framed by length and end together") {
  const auto emulator = emulator_of({});
  (void)notify(*emulator, plain_start());
  emulator->set_raw(some_raw());  // one value is 'S'
  const Emulator::Bytes good = next(*emulator);
  REQUIRE(good.size() == 24);
  const auto outcomes = [&](Emulator::Bytes bytes) {
    const auto decoder = decoder_of({.hand = Side::kRight, .layout = kPlain22});
    CollectSink sink;
    decoder->feed(good, 0, sink);
    decoder->feed(bytes, 0, sink);
    decoder->feed(good, 0, sink);
    CHECK(sink.samples.size() == static_cast<std::size_t>(sink.count(Outcome::kOk)));
    return sink.outcomes;
  };
  const auto expected = [](int ok, int is_short, int range, int foreign) {
    return std::array<int, kOutcomes>{ok, is_short, 0, range, foreign};
  };
  CHECK(outcomes(good) == expected(3, 0, 0, 0));
  CHECK(outcomes({good.begin(), good.begin() + 10}) == expected(1, 0, 0, 1));
  auto bad = good;
  bad.erase(bad.begin() + 5);  // dropped byte
  CHECK(outcomes(bad) == expected(2, 1, 0, 0));
  bad = good;
  bad[5] = std::byte{0};
  CHECK(outcomes(bad) == expected(2, 1, 0, 1));
  bad = good;
  bad.insert(bad.end() - 1, {std::byte{'e'}, std::byte{'s'}});
  CHECK(outcomes(bad) == expected(3, 0, 0, 0));
  bad.insert(bad.end() - 1,
             {std::byte{'e'}, std::byte{'g'}});  // a sensor is unplugged: no measurement
  CHECK(outcomes(bad) == expected(2, 0, 1, 0));
  bad = good;
  bad.insert(bad.end() - 1, std::byte{'x'});
  CHECK(outcomes(bad) == expected(2, 0, 0, 1));
  bad = good;
  bad[0] = std::byte{'T'};
  CHECK(outcomes(bad) == expected(2, 0, 0, 1));
  CHECK(outcomes(Emulator::Bytes(1000, std::byte{'S'})) == expected(1, 0, 0, 1));
}

TEST_CASE("a CyberGlove's time stamp crosses zero bytes and its wrap") {
  const Layout layout{.mask = kMask22, .time = true, .status = true};
  for (const std::uint32_t first : {0U, 0xFFU, 0xFFFF'FF00U, 0x0100'0000U, 0xFFFF'FFFFU}) {
    const auto emulator = emulator_of({.first_count = first});
    const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout, .ticks = 1152});
    (void)notify(*emulator, "u 1\rd 1\rt 1152 1\rS");
    CollectSink sink;
    for (int i = 0; i < 300; ++i) decoder->feed(next(*emulator), 0, sink);
    REQUIRE(sink.samples.size() == 300);
    for (std::size_t i = 0; i < 300; ++i) {
      CHECK(sink.samples[i].header.device_ns == static_cast<std::int64_t>(i) * 10'000'000);
    }
  }
}

TEST_CASE("stamps with an inconsistent flag are ignored; flags may be zero") {
  std::uint32_t count = 0;
  auto stamp = encode_stamp(0x01020304);
  CHECK(decode_stamp(stamp, count));
  CHECK(count == 0x01020304);
  stamp[0] |= std::byte{1};
  CHECK_FALSE(decode_stamp(stamp, count));
  const Layout layout{.mask = kMask22, .time = true, .status = true};
  const auto emulator = emulator_of({.first_count = 0x01010101});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout, .ticks = 1152});
  (void)notify(*emulator, "u 1\rd 1\rt 1152 1\rS");
  auto sample = next(*emulator);
  REQUIRE(sample[23] == std::byte{0x80});
  sample[23] = std::byte{0};
  CollectSink sink;
  decoder->feed(sample, 0, sink);
  CHECK(sink.count(Outcome::kOk) == 1);
}

TEST_CASE("a doubtful stamp is accepted when the next confirms it, and time always increases") {
  StampClock clock(1 << 20, 1000);
  CHECK(clock.to(100) == 0);
  CHECK(clock.to(110) == 10);
  CHECK(clock.to(500'000) == 11);  // a flipped bit
  CHECK(clock.to(120) == 20);      // the previous one was wrong
  CHECK(clock.to(130) == 30);
  CHECK(clock.to(130) == 31);  // a repeat
  CHECK(clock.to(140) == 40);
  CHECK(clock.to(5140) == 41);    // a pause
  CHECK(clock.to(5150) == 5050);  // confirmed
  CHECK(clock.to(50) == 5051);    // a restart
  CHECK(clock.to(60) == 5060);    // continues from the last time
  CHECK(clock.to(70) == 5070);
}

TEST_CASE("a polled CyberGlove without new values repeats the last ones") {
  const Layout layout{.mode = Mode::kPoll, .mask = kMask22, .time = false, .status = false};
  const auto emulator = emulator_of({});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout});
  (void)notify(*emulator, std::string("U\0D\0", 4));
  CollectSink sink;
  emulator->set_raw(some_raw());
  decoder->feed(notify(*emulator, "G"), 0, sink);
  decoder->feed(notify(*emulator, "G"), 0, sink);
  Raw other = some_raw();
  other[kThumbIp] += 1.0;
  emulator->set_raw(other);
  decoder->feed(notify(*emulator, "G"), 0, sink);
  REQUIRE(sink.samples.size() == 3);
  CHECK(sink.samples[0].quality == Quality::kMeasured);
  CHECK(sink.samples[1].quality == Quality::kHeld);
  CHECK(sink.frames[1].quality == Quality::kHeld);
  CHECK(sink.samples[2].quality == Quality::kMeasured);
}

TEST_CASE("a CyberGlove without its sensors is counted, not posed; its switch is in the sample") {
  const Layout layout{.mask = kMask22, .time = false, .status = true};
  const auto emulator = emulator_of({});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout});
  (void)notify(*emulator, std::string("U\1D\0W\1L\1S", 9));
  CollectSink sink;
  decoder->feed(next(*emulator), 0, sink);
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.samples[0].value[2 * kSensors] == 1.0F);
  CHECK(sink.samples[0].value[2 * kSensors + 1] == 1.0F);
  emulator->settings().plugged_in = false;
  decoder->feed(next(*emulator), 0, sink);
  CHECK(sink.samples.size() == 1);
  CHECK(sink.count(Outcome::kOutOfRange) == 1);
  emulator->settings().plugged_in = true;
  decoder->feed(next(*emulator), 0, sink);
  CHECK(sink.samples.size() == 2);
}

TEST_CASE("16-bit records: sixteenths of a count, strays skipped, midnight crossed") {
  const Layout layout{.form = Form::k16Bit, .mask = kMask22, .multiplier = 3};
  const auto emulator =
      emulator_of({.level_one = true, .first_sub_frame = sub_frames_a_day(3) - 10});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout, .ticks = 1280});
  CHECK(text_of(notify(*emulator, "1m\x03")) == std::string("1m\x03\0", 4));
  const Emulator::Bytes echo = notify(*emulator, "1S");
  CHECK(text_of(echo) == "1S");
  Raw raw = some_raw();
  raw[kIndexMcp] = 100.0625;
  emulator->set_raw(raw);
  CollectSink sink;
  decoder->feed(echo, 0, sink);
  for (int i = 0; i < 50; ++i) {
    emulator->settings().stray_echo = i % 7 == 3;
    decoder->feed(next(*emulator), 0, sink);
  }
  CHECK(sink.count(Outcome::kOk) == 50);
  CHECK(sink.count(Outcome::kForeign) == 0);
  REQUIRE(sink.samples.size() == 50);
  CHECK(sink.samples[0].value[kSensors + kIndexMcp] == 100.0625F);
  for (std::size_t i = 0; i < 50; ++i) {
    CHECK(sink.samples[i].header.device_ns == static_cast<std::int64_t>(i) * 1'000'000'000 / 90);
  }
}

TEST_CASE("a damaged 16-bit record loses only itself, and gives one outcome") {
  const Layout layout{.form = Form::k16Bit, .mask = kMask22, .multiplier = 1};
  const auto emulator = emulator_of({.level_one = true});
  (void)notify(*emulator, "1S");
  std::vector<Emulator::Bytes> records;
  for (int i = 0; i < 3; ++i) records.push_back(next(*emulator));
  REQUIRE(records[0].size() == kRecordBytes);
  const auto outcomes = [&](const Emulator::Bytes& middle) {
    const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout});
    CollectSink sink;
    decoder->feed(records[0], 0, sink);
    decoder->feed(middle, 0, sink);
    decoder->feed(records[2], 0, sink);
    return sink.outcomes;
  };
  const auto expected = [](int ok, int range, int foreign) {
    return std::array<int, kOutcomes>{ok, 0, 0, range, foreign};
  };
  CHECK(outcomes(records[1]) == expected(3, 0, 0));
  for (std::size_t lost = 0; lost < kRecordBytes; ++lost) {
    INFO("without byte " << lost);
    auto bad = records[1];
    bad.erase(bad.begin() + static_cast<std::ptrdiff_t>(lost));
    CHECK(outcomes(bad) == expected(2, 0, 1));
  }
  auto bad = records[1];
  bad[20] = bad[21] = std::byte{0};
  CHECK(outcomes(bad) == expected(2, 1, 0));
  bad = records[1];
  bad[20] = std::byte{0x10};
  CHECK(outcomes(bad) == expected(2, 1, 0));
  bad = records[1];
  bad[0] = std::byte{'3'};
  CHECK(outcomes(bad) == expected(2, 1, 0));
}

TEST_CASE("an 18-sensor glove's 16-bit records have empty places") {
  const Layout layout{.form = Form::k16Bit, .mask = kMask18, .multiplier = 1};
  const auto emulator = emulator_of({.mask = kMask18, .level_one = true});
  const auto decoder = decoder_of({.hand = Side::kRight, .layout = layout});
  (void)notify(*emulator, "1S");
  CollectSink sink;
  decoder->feed(next(*emulator), 0, sink);
  CHECK(sink.count(Outcome::kOk) == 1);
  CHECK(sink.samples[0].valid[kIndexDip]);
  CHECK_FALSE(sink.samples[0].valid[kSensors + kIndexDip]);
}

}  // namespace posed::drivers::cyberglove
