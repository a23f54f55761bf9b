// Gestures of bodies with the real binary: labels performed on a live body and on one without a
// device, recognised movements, refusals, and a log that replays bit for bit.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/clip/clip.hpp"
#include "proto/log/reader.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/synthetic_arms.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

constexpr const char* kTwoBodies = R"(realtime = false
[publish]
endpoint = "tcp://127.0.0.1:*"
[control]
endpoint = "tcp://127.0.0.1:*"
[[stream]]
name = "actor"
driver = "file"
[stream.file]
path = "take.bvh"
[stream.generate]
model = "arms.gesture"
[[stream]]
name = "puppet"
driver = "labels"
[stream.labels]
body = "take.bvh"
rate_hz = 60.0
[stream.generate]
model = "arms.gesture"
)";

void write_bodies(const Served& served) {
  REQUIRE(clip::write_bvh(raise_take({.left = true, .take = 77}), served.path("take.bvh")));
  REQUIRE(gesture::save_model(synthetic_arms(), served.path("arms.gesture")));
  served.folder.write("posed.toml", kTwoBodies);
}

// The sources and labels of the next frames.
std::vector<std::pair<std::string, std::string>> coming(const std::string& publish,
                                                        const std::string& stream, int count) {
  const auto got = posed({"monitor", "--connect", publish, "--stream", stream, "--json", "--count",
                          std::to_string(count)});
  INFO(got.err);
  REQUIRE(got.code == 0);
  std::istringstream lines(got.out);
  std::vector<std::pair<std::string, std::string>> frames;
  for (std::string line; std::getline(lines, line);) {
    const json frame = json::parse(line);
    frames.emplace_back(frame.at("source"), frame.at("label"));
  }
  return frames;
}

bool has_frame(const std::vector<std::pair<std::string, std::string>>& frames,
               const std::string& source, const std::string& label) {
  return std::ranges::find(frames, std::pair(source, label)) != frames.end();
}

}  // namespace

TEST_CASE("a log of bodies that perform and are recognised replays to the bit", "[body]") {
  Served served;
  write_bodies(served);
  Process record({"record", "--config", served.path("posed.toml"), "--out", served.path("a.plog"),
                  "--frames"});
  const auto ready = record.line();
  INFO(record.errors());
  REQUIRE(ready);
  const std::string control = json::parse(*ready).at("control");
  const std::string publish = json::parse(*ready).at("publish");
  const auto ctl = [&](std::vector<std::string> what) {
    what.insert(what.begin(), {"ctl", "--connect", control});
    const auto outcome = posed(std::move(what));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  };
  CHECK(has_frame(coming(publish, "actor", 100), "SOURCE_FILE", "raise-left"));
  ctl({"play", "actor", "raise-both", "--tempo", "2"});
  CHECK(has_frame(coming(publish, "actor", 20), "SOURCE_LABELS", "raise-both"));
  ctl({"play", "puppet", "raise-right rest", "--loop", "--tempo", "1.5"});
  CHECK(has_frame(coming(publish, "puppet", 60), "SOURCE_LABELS", "raise-right"));
  ctl({"model", "actor", served.path("arms.gesture")});
  ctl({"stop-playing", "puppet"});
  (void)coming(publish, "actor", 30);
  record.send(SIGTERM);
  CHECK(record.exit_code() == 0);
  const auto replay = posed({"replay", served.path("a.plog"), "--speed", "max", "--out",
                             served.path("FRAMES.bin"), "--expect"});
  INFO(replay.err << replay.out);
  CHECK(replay.code == 0);
}

TEST_CASE("a performance is styled, live behind generate and offline behind synth", "[body]") {
  Served served;
  write_bodies(served);
  for (const auto& [name, family] : {std::pair("march.bvh", motion::WalkerFamily::kMarch),
                                     std::pair("sway.bvh", motion::WalkerFamily::kSway)}) {
    const auto walk = motion::make_walker({.family = family, .person = 3});
    REQUIRE(walk.has_value());
    REQUIRE(clip::write_bvh(*walk, served.path(name)));
  }
  const auto run = [](std::vector<std::string> what) {
    const auto outcome = posed(std::move(what));
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
  };
  run({"train", "style", "--from", served.path("march.bvh"), "--to", served.path("sway.bvh"),
       "--out", served.path("sway.style")});
  std::string config = kTwoBodies;
  const std::size_t live = config.find("[[stream]]");
  config.erase(live);
  for (const char* name : {"plain", "styled"}) {
    config += std::string("[[stream]]\nname = \"") + name + "\"\ndriver = \"labels\"\n";
    if (name == std::string("styled")) config += "stages = [\"generate\", \"style\"]\n";
    config +=
        "[stream.labels]\nbody = \"take.bvh\"\n[stream.generate]\n"
        "model = \"arms.gesture\"\nlabels = \"raise-left rest\"\nloop = true\n";
  }
  config += "[stream.style]\nmodel = \"sway.style\"\ngate = false\n";
  served.folder.write("posed.toml", config);
  run({"record", "--config", served.path("posed.toml"), "--out", served.path("s.plog"), "--frames",
       "--seconds", "3"});
  run({"replay", served.path("s.plog"), "--speed", "max", "--out", served.path("FRAMES.bin"),
       "--expect"});
  auto reader = log::Reader::open(served.path("s.plog"));
  REQUIRE(reader);
  auto plain = reader->frames(0, false).value(), styled = reader->frames(1, false).value();
  int performed = 0, changed = 0;
  for (auto a = plain.next().value(), b = styled.next().value(); a && b;
       a = plain.next().value(), b = styled.next().value()) {
    v1::Frame before, after;
    REQUIRE(before.ParseFromArray(a->bytes.data(), static_cast<int>(a->bytes.size())));
    REQUIRE(after.ParseFromArray(b->bytes.data(), static_cast<int>(b->bytes.size())));
    REQUIRE(before.sequence() == after.sequence());
    if (before.label() != "raise-left") continue;
    CHECK(after.label() == "raise-left");
    CHECK(after.source() == v1::SOURCE_LABELS);
    ++performed;
    for (int i = 0; i < before.rotation_xyzw_size(); ++i) {
      if (std::abs(before.rotation_xyzw(i) - after.rotation_xyzw(i)) < 0.01F) continue;
      ++changed;
      break;
    }
  }
  CHECK(performed > 20);
  CHECK(changed >= performed - 1);  // alpha rises from 0 in the first frame

  run({"synth", "--model", served.path("arms.gesture"), "--labels", "raise-left rest", "--body",
       served.path("take.bvh"), "--out", served.path("synth.bvh")});
  const auto applied = posed({"apply", "--model", served.path("sway.style"), "--gate", "off",
                              served.path("synth.bvh"), "--out", served.path("styled.bvh")});
  INFO(applied.err);
  REQUIRE(applied.code == 0);
  const auto one = clip::read_clip(served.path("synth.bvh")),
             other = clip::read_clip(served.path("styled.bvh"));
  REQUIRE((one && other));
  CHECK(one->frames() == other->frames());
  CHECK_FALSE(one->channels.isApprox(other->channels, 1e-3));
}

TEST_CASE("a model of a body is refused where there is none", "[body]") {
  Served served;
  write_bodies(served);
  const auto check = [&](const std::string& stream) {
    served.folder.write("posed.toml", "[[stream]]\nname = \"w\"\n" + stream);
    return posed({"check", "--config", served.path("posed.toml")});
  };
  CHECK(one_sentence(check("driver = \"labels\"\n[stream.generate]\nmodel = \"arms.gesture\"\n"), 1,
                     "the model is of a body"));
  CHECK(one_sentence(check("driver = \"labels\"\n[stream.labels]\nbody = \"none.bvh\"\n"), 1,
                     "none.bvh"));
}

}  // namespace posed::test
