// Gestures of bodies with the real binary: labels performed on a live body and on one without a
// device, recognised movements, refusals, and a log that replays bit for bit.
#include <algorithm>
#include <csignal>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "proto/clip/clip.hpp"
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
