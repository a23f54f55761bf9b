// Hands with the real binary: labels performed on a live hand and on a stream without a device, the
// published frames, refusals, and a log that replays bit for bit.
#include <algorithm>
#include <sstream>

#include "models/gesture/model_file.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

constexpr const char* kTwoHands = R"(realtime = false
[publish]
endpoint = "tcp://127.0.0.1:*"
[control]
endpoint = "tcp://127.0.0.1:*"
[[stream]]
name = "hand"
driver = "file"
[stream.file]
path = "hand.csv"
[stream.generate]
lag_frames = 2
model = "toy.gesture"
[[stream]]
name = "puppet"
driver = "labels"
[stream.labels]
side = "left"
rate_hz = 60.0
[stream.generate]
model = "toy.gesture"
labels = "p"
)";

void write_hands(const Served& served) {
  const auto signer = gesture::make_performance({.person = 5, .gestures = 12});
  REQUIRE(signer);
  REQUIRE(clip::write_hand_csv(signer->clip, served.folder.path() / "hand.csv"));
  REQUIRE(gesture::save_model(toy_gesture_model(), served.folder.path() / "toy.gesture"));
  served.folder.write("posed.toml", kTwoHands);
}

std::vector<json> frames_of(const Served& served, const std::string& stream, int count) {
  const auto got = posed({"monitor", "--connect", served.publish, "--stream", stream, "--json",
                          "--count", std::to_string(count)});
  REQUIRE(got.code == 0);
  std::istringstream lines(got.out);
  std::vector<json> frames;
  for (std::string line; std::getline(lines, line);) frames.push_back(json::parse(line));
  REQUIRE(static_cast<int>(frames.size()) == count);
  return frames;
}

// Whether one of the next `most` frames has this source and label.
bool comes(const Served& served, const std::string& stream, const std::string& source,
           const std::string& label, int most) {
  return std::ranges::any_of(frames_of(served, stream, most), [&](const json& frame) {
    return frame.at("source") == source && frame.at("label") == label;
  });
}

TEST_CASE("labels are performed on a live hand and on a stream without a device") {
  Served served;
  write_hands(served);
  served.start();
  const auto ctl = [&](std::vector<std::string> what) {
    what.insert(what.begin(), {"ctl", "--connect", served.control});
    return posed(std::move(what));
  };
  const json live = frames_of(served, "hand", 10).back();
  CHECK(live.at("source") == "SOURCE_FILE");
  CHECK(live.at("lagFrames") == 2);
  CHECK(live.at("lagMs").get<double>() == Approx(2000.0 / 30.0).margin(0.5));
  CHECK(live.at("angleRad").size() == 45);

  // In a loop, because a monitor may begin late on a busy machine.
  const auto played = ctl({"play", "hand", "1 3", "--tempo", "2", "--loop"});
  INFO(played.err);
  REQUIRE(played.code == 0);
  CHECK(played.out.starts_with("hand: in effect from frame "));
  CHECK(comes(served, "hand", "SOURCE_LABELS", "1", 120));
  CHECK(comes(served, "hand", "SOURCE_LABELS", "3", 120));
  // Labels that are not repeated end by themselves, and the hand is live again.
  REQUIRE(ctl({"stop-playing", "hand"}).code == 0);
  REQUIRE(ctl({"play", "hand", "1", "--tempo", "2"}).code == 0);
  CHECK(comes(served, "hand", "SOURCE_FILE", live.at("label"), 120));

  REQUIRE(ctl({"--json", "play", "puppet", "g 4", "--loop"}).code == 0);
  CHECK(comes(served, "puppet", "SOURCE_LABELS", "4", 400));
  const json puppet = frames_of(served, "puppet", 1).back();
  CHECK(puppet.at("lagFrames") == 0);
  CHECK(puppet.at("labelProbability") == 1.0);
  CHECK(puppet.at("quality") == "QUALITY_MEASURED");
  REQUIRE(ctl({"stop-playing", "puppet"}).code == 0);
  const json held = frames_of(served, "puppet", 90).back();
  CHECK(held.at("quality") == "QUALITY_HELD");
  CHECK(held.at("label") == "");
  CHECK(has(ctl({"status"}).out, "lag 2 frames"));
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
}

TEST_CASE("an impossible play gives one error message and an exit code") {
  Served served;
  write_hands(served);
  served.folder.write("posed.toml", std::string(kTwoHands) +
                                        "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n"
                                        "[stream.file]\npath = \"walk.bvh\"\n"
                                        "[[stream]]\nname = \"bare\"\ndriver = \"labels\"\n"
                                        "[stream.generate]\n");
  served.start();
  const auto refusal = [&](std::vector<std::string> what) {
    what.insert(what.begin(), {"ctl", "--connect", served.control});
    const auto outcome = posed(std::move(what));
    CHECK(outcome.code == 1);
    return outcome.err;
  };
  CHECK(has(refusal({"play", "hand", "g x"}), "label 'x' ... g c p 1 3 4"));
  CHECK(has(refusal({"play", "hand", " "}), "no label"));
  CHECK(has(refusal({"play", "hand", "g", "--tempo", "3"}), "0.5 to 2"));
  CHECK(has(refusal({"play", "hand", std::string(600, 'g')}),
            "'" + std::string(kMaxNameBytes, 'g') + "...'"));
  std::string many;
  for (int i = 0; i < 257; ++i) many += "g ";
  CHECK(has(refusal({"play", "hand", many}), "at most 256"));
  CHECK(has(refusal({"play", "nobody", "g"}), "'nobody'"));
  CHECK(has(refusal({"play", "walker", "g"}), "[stream.generate]"));
  CHECK(has(refusal({"play", "bare", "g"}), "no gesture model"));
  CHECK(has(refusal({"stop-playing", "walker"}), "[stream.generate]"));
  CHECK(has(refusal({"model", "walker", served.path("toy.gesture")}), "for stage generate"));
  CHECK(has(refusal({"model", "hand", served.path("one.style")}), "[stream.style]"));
  const auto model =
      posed({"ctl", "--connect", served.control, "model", "bare", served.path("toy.gesture")});
  CHECK(model.code == 0);
  CHECK(posed({"ctl", "--connect", served.control, "play", "bare", "g"}).code == 0);
}

TEST_CASE("a config that cannot be performed is refused with the stream's name") {
  Served served;
  write_hands(served);
  const auto check = [&](const std::string& stream) {
    served.folder.write("posed.toml", "[[stream]]\nname = \"w\"\n" + stream);
    return posed({"check", "--config", served.path("posed.toml")});
  };
  const auto body = check(
      "driver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\n[stream.generate]\n"
      "model = \"toy.gesture\"\n");
  CHECK(body.code == 1);
  CHECK(has(body.err, "stream 'w': "));
  CHECK(has(body.err, "the model is of hands"));
  const auto label =
      check("driver = \"labels\"\n[stream.generate]\nmodel = \"toy.gesture\"\nlabels = \"g x\"\n");
  CHECK(label.code == 2);
  CHECK(has(label.err, "label 'x'"));
  const auto fine =
      check("driver = \"labels\"\n[stream.generate]\nmodel = \"toy.gesture\"\nlabels = \"g p\"\n");
  INFO(fine.err);
  CHECK(fine.code == 0);
}

TEST_CASE("a live hand is published as `posed smooth` writes it") {
  Served served;
  write_hands(served);
  served.folder.write("posed.toml", R"(realtime = false
[publish]
endpoint = "tcp://127.0.0.1:*"
[control]
endpoint = "tcp://127.0.0.1:*"
[[stream]]
name = "hand"
driver = "file"
[stream.file]
path = "hand.csv"
loop = false
pace = 0
[stream.generate]
lag_frames = 2
noise_deg = 0.5
[stream.constrain]
enabled = false
)");
  const auto recorded = posed({"record", "--config", served.path("posed.toml"), "--out",
                               served.path("a.plog"), "--frames", "--until-end"});
  INFO(recorded.err);
  REQUIRE(recorded.code == 0);
  const auto smoothed = posed({"smooth", "--lag", "2", "--noise-deg", "0.5",
                               served.path("hand.csv"), "--out", served.path("smooth.csv")});
  INFO(smoothed.err);
  REQUIRE(smoothed.code == 0);
  const auto offline = clip::read_hand_clip(served.path("smooth.csv"));
  REQUIRE(offline);
  auto reader = log::Reader::open(served.path("a.plog"));
  REQUIRE(reader);
  auto frames = reader->frames(0, false).value();
  std::size_t last = 0, count = 0, compared = 0;
  for (auto row = frames.next().value(); row; row = frames.next().value(), ++count) {
    v1::Frame frame;
    REQUIRE(frame.ParseFromArray(row->bytes.data(), static_cast<int>(row->bytes.size())));
    // On a busy machine the log lacks published frames that a replay makes again.
    REQUIRE(frame.sequence() > last);
    REQUIRE(frame.sequence() <= offline->angles.size());
    last = frame.sequence();
    // Frames that a busy machine emitted early have less lag, and the last frames have none.
    if (frame.lag_frames() != 2) continue;
    ++compared;
    double most = 0.0;
    for (int c = 0; c < frame.angle_rad_size(); ++c) {
      const std::size_t angle = kAngleOfChannel[static_cast<std::size_t>(c)];
      most = std::max(most, std::abs(frame.angle_rad(c) - offline->angles[last - 1][angle]));
    }
    CHECK(most < 1e-5);
  }
  const std::size_t all = offline->angles.size();
  CHECK(count > all * 8 / 10);
  // Every frame that the log lacks is told.
  const std::string missing = "; " + std::to_string(all - count) + " published frame";
  CHECK((count == all || has(recorded.err, missing)));
  CHECK(compared > count * 9 / 10);
}

TEST_CASE("a log of smoothing, plays and a new model replays to the bit") {
  Served served;
  write_hands(served);
  Process record({"record", "--config", served.path("posed.toml"), "--out", served.path("a.plog"),
                  "--frames"});
  const auto ready = record.line();
  INFO(record.errors());
  REQUIRE(ready);
  const std::string control = json::parse(*ready).at("control");
  served.publish = json::parse(*ready).at("publish");
  const auto ctl = [&](std::vector<std::string> what) {
    what.insert(what.begin(), {"ctl", "--connect", control});
    const auto outcome = posed(std::move(what));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  };
  (void)frames_of(served, "hand", 20);
  ctl({"play", "hand", "1 c", "--tempo", "2"});
  (void)frames_of(served, "hand", 40);
  ctl({"play", "puppet", "g 4", "--loop", "--tempo", "1.5"});
  ctl({"play", "hand", "4"});
  (void)frames_of(served, "hand", 30);
  ctl({"model", "hand", served.path("toy.gesture")});
  ctl({"stop-playing", "puppet"});
  (void)frames_of(served, "hand", 30);
  record.send(SIGTERM);
  CHECK(record.exit_code() == 0);
  const auto replay = posed({"replay", served.path("a.plog"), "--speed", "max", "--out",
                             served.path("FRAMES.bin"), "--expect"});
  INFO(replay.err << replay.out);
  CHECK(replay.code == 0);
}

}  // namespace
}  // namespace posed::test
