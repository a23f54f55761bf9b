// The hands of two emulated gloves on a walker, with the real binary: one glove is unplugged and
// plugged in again, the body loses no frame, and the log replays bit for bit.
#include <catch2/catch.hpp>

#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/emulated_glove.hpp"

namespace posed::test {
namespace {

constexpr std::size_t kMergedJoints = 2 * 15;  // of the hands

void plug_in_hand(const Stage& stage, const std::string& hand,
                  std::optional<EmulatedGlove>& glove) {
  glove.emplace(stage.path(hand), std::vector<std::string>{"--set", "hand=" + hand});
}

// The next frames of the body, as JSON.
std::vector<std::string> next_bodies(const Stage& stage, int count) {
  Process frames({"monitor", "--connect", stage.publish, "--stream", "body", "--json", "--count",
                  std::to_string(count)});
  std::vector<std::string> bodies;
  while (const auto line = frames.line()) bodies.push_back(*line);
  CHECK(frames.exit_code() == 0);
  return bodies;
}

}  // namespace

TEST_CASE("a walker gets the hands of two gloves, and keeps walking when one is unplugged") {
  Stage stage;
  const auto walk = motion::make_walker({.seconds = 4.0}).value();
  REQUIRE(clip::write_bvh(walk, stage.folder.path() / "walk.bvh"));
  std::string config =
      std::string(Stage::kEndpoints) +
      "[[stream]]\nname = \"body\"\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\n"
      "[stream.merge]\nleft = \"left\"\nright = \"right\"\n";
  for (const std::string hand : {"left", "right"}) {
    config += "[[stream]]\nname = \"" + hand + "\"\ndriver = \"lucidgloves\"\nport = \"" +
              stage.path(hand) + "\"\nhand = \"" + hand + "\"\n";
  }
  stage.folder.write("posed.toml", config);
  std::optional<EmulatedGlove> left, right;
  plug_in_hand(stage, "left", left);
  plug_in_hand(stage, "right", right);
  stage.record();
  CHECK(next_bodies(stage, 60).size() == 60);
  right->end();
  CHECK(next_bodies(stage, 90).size() == 90);
  plug_in_hand(stage, "right", right);
  const auto bodies = next_bodies(stage, 60);
  REQUIRE(bodies.size() == 60);
  const auto last = nlohmann::json::parse(bodies.back());
  CHECK(last.at("rotationXyzw").size() == 4 * (walk.skeleton->joints.size() + kMergedJoints));
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  CHECK(check_frames_follow(stage.path("take.plog"), "body") > 100);
  const auto replay = posed({"replay", stage.path("take.plog"), "--speed", "max", "--out",
                             stage.path("frames.bin"), "--expect"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

}  // namespace posed::test
