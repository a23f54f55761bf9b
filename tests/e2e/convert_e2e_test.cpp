// `posed convert` of a log written by `posed record`: a body to a BVH, a hand to a CSV.
#include <catch2/catch.hpp>

#include <chrono>
#include <csignal>
#include <thread>

#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/served.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr int kTakeFrames = 240;

// A walker and a hand, each played once from its file as fast as possible, so that nothing is
// skipped.
class Take : public Stage {
 public:
  Take() {
    REQUIRE(clip::write_bvh(toy_walk(kTakeFrames, 120.0), folder.path() / "walk.bvh"));
    clip::HandClip hand;
    for (int i = 0; i < kTakeFrames; ++i) {
      hand.time_s.push_back(i / 100.0);
      hand.angles.emplace_back().fill(0.001 * i);
    }
    REQUIRE(clip::write_hand_csv(hand, folder.path() / "hand.csv"));
    std::string config = kEndpoints;
    for (const std::string file : {"walk.bvh", "hand.csv"}) {
      config += "[[stream]]\nname = \"" + file.substr(0, 4) +
                "\"\ndriver = \"file\"\n[stream.file]\n" + "path = \"" + file +
                "\"\nloop = false\npace = 0.0\n";
    }
    folder.write("posed.toml", config + "[stream.constrain]\nenabled = false\n");
  }

  [[nodiscard]] ProgramOutcome convert(const std::string& out,
                                       std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"convert", path("take.plog"), "--out", path(out), "--json"});
    return posed(std::move(more));
  }

  // A log may be read while it is written.
  [[nodiscard]] json convert_all(const std::string& out, const std::string& stream) const {
    ProgramOutcome outcome = convert(out, {"--stream", stream});
    for (int i = 0; i < 100; ++i) {
      if (outcome.code == 0 && json::parse(outcome.out).at("frames") == kTakeFrames) break;
      std::this_thread::sleep_for(100ms);
      outcome = convert(out, {"--stream", stream, "--overwrite"});
    }
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return json::parse(outcome.out);
  }
};

}  // namespace

TEST_CASE("convert writes what a log's streams published") {
  Take stage;
  stage.record();
  const json walk = stage.convert_all("walk-out.bvh", "walk");
  const json hand = stage.convert_all("hand-out.csv", "hand");
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  CHECK(walk.at("frames") == kTakeFrames);
  CHECK(walk.at("warnings").empty());
  CHECK(hand.at("frames") == kTakeFrames);

  const auto made = clip::read_clip(stage.path("walk-out.bvh"));
  const auto given = clip::read_clip(stage.path("walk.bvh"));
  REQUIRE(made);
  REQUIRE(given);
  CHECK(made->frame_rate_hz == Approx(120.0));
  CHECK(made->skeleton->id == given->skeleton->id);
  CHECK((made->channels - given->channels).cwiseAbs().maxCoeff() < 1e-6);
  const auto made_hand = clip::read_hand_clip(stage.path("hand-out.csv"));
  const auto given_hand = clip::read_hand_clip(stage.path("hand.csv"));
  REQUIRE(made_hand);
  REQUIRE(given_hand);
  for (std::size_t i = 0; i < kTakeFrames; ++i) {
    CHECK(made_hand->time_s[i] == Approx(given_hand->time_s[i]).margin(1e-6));
    for (std::size_t a = 0; a < kHandChannels; ++a) {
      CHECK(made_hand->angles[i][a] == Approx(given_hand->angles[i][a]).margin(1e-6));
    }
  }
}

TEST_CASE("a retargeted stream is published, replayed and converted on its new skeleton") {
  Stage stage;
  const auto walk = motion::make_walker({.seconds = 2.0, .rate_hz = 60.0}).value();
  REQUIRE(clip::write_bvh(walk, stage.folder.path() / "walk.bvh"));
  REQUIRE(clip::write_bvh(toy_walk(2, 60.0), stage.folder.path() / "toy.bvh"));
  const auto mirror = [&](const std::string& out) {
    return posed({"convert", stage.path("walk.bvh"), "--mirror", "--out", stage.path(out)});
  };
  CHECK(mirror("other.bvh").code == 0);
  CHECK(clip::read_clip(stage.path("other.bvh"))->channels !=
        clip::read_clip(stage.path("walk.bvh"))->channels);
  CHECK(has(mirror("other.csv").err, "--mirror is for clips of bodies"));
  std::string config = Stage::kEndpoints;
  for (const std::string to : {"humanoid", "toy.bvh"}) {
    config += "[[stream]]\nname = \"" + to.substr(0, 3) + "\"\ndriver = \"file\"\n[stream.file]\n" +
              "path = \"walk.bvh\"\nloop = false\npace = 0.0\n[stream.retarget]\nto = \"" + to +
              "\"\n";
  }
  stage.folder.write("posed.toml", config);
  stage.record();
  for (int i = 0; i < 50 && !has(stage.ctl({"status"}).out, "ended"); ++i) {
    std::this_thread::sleep_for(50ms);
  }
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  std::filesystem::remove(stage.folder.path() / "toy.bvh");  // the log has what it needs
  stage.check_replay();
  const auto converted = [&](const std::string& stream) {
    const ProgramOutcome outcome = posed({"convert", stage.path("take.plog"), "--stream", stream,
                                          "--out", stage.path(stream + ".bvh")});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return clip::read_clip(stage.path(stream + ".bvh")).value();
  };
  const clip::Clip humanoid = converted("hum");
  CHECK(humanoid.frames() == walk.frames());
  CHECK(humanoid.skeleton->joint_index("leftUpperArm") > 0);
  CHECK(converted("toy").skeleton->joints.size() == toy_walk(2, 60.0).skeleton->joints.size());
}

TEST_CASE("convert reports what a log lacks and wrong use") {
  Take stage;
  stage.record();
  (void)stage.convert_all("walk.out.bvh", "walk");
  stage.daemon->send(SIGKILL);  // the log of a killed daemon works, too
  REQUIRE(stage.daemon->exit_code());
  const ProgramOutcome unclear = stage.convert("out.bvh");
  CHECK(unclear.code == 2);
  CHECK(has(unclear.err, "hand, walk"));
  CHECK(has(unclear.err, "--stream"));
  CHECK(stage.convert("out.bvh", {"--stream", "nobody"}).code == 2);
  CHECK(stage.convert("out.plog", {"--stream", "walk"}).code == 2);
  const ProgramOutcome no_hand = stage.convert("out.csv", {"--stream", "walk"});
  CHECK(no_hand.code == 1);
  CHECK(has(no_hand.err, "hand"));
  const ProgramOutcome no_log =
      posed({"convert", stage.path("walk.bvh"), "--stream", "walk", "--out", stage.path("o.bvh")});
  CHECK(no_log.code == 2);
  CHECK(has(no_log.err, "not a device log"));
}

}  // namespace posed::test
