// A style and signs are taught on the stage with the real binary: an emulated mocap system sends a
// performer who walks as usual and then in a style, an emulated glove or camera a hand that makes a
// sign;
// `posed ctl teach` does the rest.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "daemon/tools/emulate/motions.hpp"
#include "drivers/driver.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/has.hpp"

namespace posed::test {
namespace {

using motion::WalkerFamily;

// The mocap system; its performer is on the stage of the daemon.
class Performer {
 public:
  explicit Performer(const Stage& stage) {
    auto emulator = drivers::find_driver("mvn")->emulate({}).value();
    const emulate::Motion march = motion_of(stage, *emulator, "march", WalkerFamily::kMarch);
    const emulate::Motion sway = motion_of(stage, *emulator, "sway", WalkerFamily::kSway);
    device_ = std::make_unique<emulate::EmulatedDevice>(
        std::move(emulator), emulate::EmulatedPort::open_udp({listen}, {0}).value(),
        [this, march, sway](double time_s, drivers::Emulator& body) {
          (sways ? sway : march)(time_s, body);
        },
        emulate::EmulatedDevice::Settings());
    thread_ = std::jthread([this](const std::stop_token& stop) { device_->run(stop); });
  }

  const std::string listen = "127.0.0.1:" + std::to_string(free_port());
  std::atomic<bool> sways{false};

 private:
  static emulate::Motion motion_of(const Stage& stage, drivers::Emulator& emulator,
                                   const std::string& name, WalkerFamily family) {
    const auto walk = motion::make_walker({.family = family, .seconds = 60.0}).value();
    REQUIRE(clip::write_bvh(walk, stage.path(name + ".bvh")));
    return emulate::clip_motion({stage.path(name + ".bvh")}, emulator).value();
  }

  std::unique_ptr<emulate::EmulatedDevice> device_;
  std::jthread thread_;
};

// An emulated device with a right hand that rests open, and closes to a fist when it is told.
class Hand {
 public:
  static constexpr double kWay_s = 0.5, kHold_s = 1.6;

  Hand(const std::string& driver, const drivers::Options& options, emulate::EmulatedPort port,
       std::size_t body) {
    device_ = std::make_unique<emulate::EmulatedDevice>(
        drivers::find_driver(driver)->emulate(options).value(), std::move(port),
        [this, body](double time_s, drivers::Emulator& device) {
          now_s_ = time_s;
          Frame frame;
          set_hand_angles(hand_, angles_at(time_s - fist_s_), frame);
          device.pose(body, frame);
        },
        emulate::EmulatedDevice::Settings());
    thread_ = std::jthread([this](const std::stop_token& stop) { device_->run(stop); });
  }
  // A fist, so long from now.
  void fist_in(double seconds) { fist_s_ = now_s_ + seconds; }
  [[nodiscard]] std::string port() const { return device_->port(); }

 private:
  static HandAngles angles_at(double since_s) {
    const double in = std::clamp(since_s / kWay_s, 0.0, 1.0);
    const double out = std::clamp((since_s - kWay_s - kHold_s) / kWay_s, 0.0, 1.0);
    const auto smooth = [](double t) { return t * t * t * (10.0 + t * (6.0 * t - 15.0)); };
    HandAngles angles{};
    for (std::size_t c = 0; c < angles.size(); c += 3) {
      angles[c] = (0.1 + smooth(in) - smooth(out));  // flexions [rad]
    }
    return angles;
  }

  const Skeleton hand_ = hand_skeleton(Side::kRight);
  std::atomic<double> now_s_{0.0}, fist_s_{-100.0};
  std::unique_ptr<emulate::EmulatedDevice> device_;
  std::jthread thread_;
};

// A fist is taught to the stream, recognised and performed, and all of it is replayed.
void teach_fist(Stage& stage, Hand& hand, const std::string& stream, const std::string& source) {
  std::filesystem::create_directory(stage.path("models"));
  stage.folder.write("posed.toml",
                     std::string(Stage::kEndpoints) + "models = \"models\"\n" + source);
  stage.record();
  stage.await_frames(stream, 5);
  Process lesson({"ctl", "--connect", stage.control, "teach", stream, "--name", "mine", "--signs",
                  "fist", "--show", "6"});
  // The countdown has three seconds; a show that a busy machine cut is asked for once more.
  for (std::string heard; !has(heard, "fist: show 3");) {
    hand.fist_in(3.0 + 1.6);
    const auto line = lesson.line();
    INFO(lesson.errors());
    REQUIRE(line);
    heard = *line;
  }
  const auto learnt = lesson.line();
  REQUIRE(learnt);
  CHECK(has(*learnt, "knows fist, rest from 3 shows"));
  const auto in_use = lesson.line();
  REQUIRE(in_use);
  CHECK(has(*in_use, stream + ": mine.gesture is in effect from frame"));
  CHECK(lesson.exit_code() == 0);
  CHECK(has(stage.ctl({"models"}).out, "generate   mine.gesture"));
  stage.await_frames(stream, 60);
  hand.fist_in(0.0);
  stage.await_frames(stream, 200);
  CHECK(stage.ctl({"play", stream, "fist rest"}).code == 0);
  stage.await_frames(stream, 60);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);

  int recognised = 0, performed = 0;
  check_frames_follow(stage.path("take.plog"), stream, [&](const v1::Frame& frame) {
    if (frame.label() != "fist") return;
    ++(frame.source() == v1::SOURCE_LABELS ? performed : recognised);
  });
  CHECK(recognised > 10);
  CHECK(performed > 10);
  stage.check_replay();
}

}  // namespace

TEST_CASE("signs are taught on the stage, played, and replayed bit for bit", "[teach]") {
  Stage stage;
  Hand hand("cyberglove", {}, emulate::EmulatedPort::open_pty().value(), 0);
  teach_fist(stage, hand, "hand",
             "[[stream]]\nname = \"hand\"\ndriver = \"cyberglove\"\npublish_raw = true\nport = \"" +
                 hand.port() + "\"\n[stream.generate]\nmodel = \"\"\n");
}

// A visitor's minute without a browser.
TEST_CASE("a hand before a camera is taught a sign of its own and performs it", "[teach]") {
  Stage stage;
  const std::string listen = "127.0.0.1:" + std::to_string(free_port());
  Hand hand("landmarks", {{"rate_hz", 30.0}},
            emulate::EmulatedPort::open_udp({listen}, {0}).value(), 1);
  teach_fist(stage, hand, "camera-right",
             "[[source]]\nname = \"camera\"\ndriver = \"landmarks\"\nstreams = \"all\"\n"
             "stale_after_s = 2.0\npublish_raw = true\n[source.landmarks]\nlisten = \"" +
                 listen + "\"\nrate_hz = 30\n[source.generate]\nmodel = \"\"\n");
}

TEST_CASE("a style is taught on the stage, and the log replays it bit for bit", "[teach]") {
  const std::string name = "mvn-walker";
  Stage stage;
  Performer performer(stage);
  std::filesystem::create_directory(stage.path("models"));
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                       "models = \"models\"\n[[source]]\nname = \"mvn\"\n"
                                       "driver = \"mvn\"\nstreams = \"all\"\npublish_raw = true\n"
                                       "[source.mvn]\nlisten = \"" +
                                       performer.listen + "\"\n[source.style]\nmodel = \"\"\n");
  stage.record();
  stage.await_frames(name, 5);
  const auto bad =
      stage.ctl({"teach", name, "--name", "../sway", "--neutral", "0", "--style", "0"});
  CHECK(bad.code == 1);
  CHECK(has(bad.err, "cannot be the name of a style"));

  Process lesson({"ctl", "--connect", stage.control, "teach", name, "--name", "sway", "--neutral",
                  "6", "--style", "6"});
  const auto usual = lesson.line();
  INFO(lesson.errors());
  REQUIRE(usual);
  CHECK(has(*usual, "walk as you are: ... strides in"));
  performer.sways = true;  // before the countdown of the second walk is over
  const auto styled = lesson.line();
  REQUIRE(styled);
  CHECK(has(*styled, "walk in the style (sway): ... strides in"));
  REQUIRE(lesson.line());  // how much was learnt
  const auto in_use = lesson.line();
  REQUIRE(in_use);
  CHECK(has(*in_use, name + ": sway.style is in effect from frame"));
  CHECK(lesson.exit_code() == 0);
  performer.sways = false;
  stage.await_frames(name, 60);
  CHECK(has(stage.ctl({"models"}).out, "style      sway.style"));
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);

  // No frame is lost, and those before the model are as they were sent.
  const std::uint64_t first = std::stoull(in_use->substr(in_use->find("frame ") + 6));
  std::uint64_t changed_before = 0, changed_since = 0;
  const std::string log = stage.path("take.plog");
  auto reader = log::Reader::open(log);
  REQUIRE(reader);
  for (const log::StreamRow& row : reader->streams()) {
    if (row.name != name) continue;
    auto raw = reader->frames(row.id, true);
    REQUIRE(raw);
    auto input = raw->next();
    check_frames_follow(log, name, [&](const v1::Frame& frame) {
      while (input && *input && (*input)->sequence < frame.sequence()) input = raw->next();
      if (!input || !*input || (*input)->sequence != frame.sequence()) return;
      v1::Frame before;
      const auto bytes = (*input)->bytes;
      REQUIRE(before.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
      const bool same = std::ranges::equal(before.rotation_xyzw(), frame.rotation_xyzw());
      if (!same) ++(frame.sequence() < first ? changed_before : changed_since);
    });
  }
  CHECK(changed_before == 0);
  CHECK(changed_since > 30);
  const ProgramOutcome replay = posed({"replay", log, "--speed", "max", "--expect"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

}  // namespace posed::test
