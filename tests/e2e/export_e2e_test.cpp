// `posed convert` to files that other programs open: what it writes and what it refuses. Whether
// those programs can open them is tested by tests/npm and tests/blender.
#include <catch2/catch.hpp>

#include <filesystem>

#include <nlohmann/json.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// Any log; this one holds streams "a" and "b".
std::string staged_log() { return golden("replay/staged.plog").string(); }

}  // namespace

TEST_CASE(
    "convert writes .glb and .vrma of a clip and .glb and .mcap of a log, the same each time") {
  const TempFolder folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const auto walk = motion::make_walker({.seconds = 1.0, .rate_hz = 30.0}).value();
  REQUIRE(clip::write_bvh(walk, path("walk.bvh")));
  const auto check = [&](std::vector<std::string> words, const std::string& out,
                         const std::string& begins) {
    words.insert(words.begin(), "convert");
    words.insert(words.end(), {"--json", "--overwrite", "--out", path(out)});
    std::string first;
    for (int i = 0; i < 2; ++i) {
      const ProgramOutcome outcome = posed(words);
      INFO(outcome.err);
      REQUIRE(outcome.code == 0);
      CHECK(nlohmann::json::parse(outcome.out).at("out") == path(out));
      const std::string file = file_text(path(out));
      CHECK(file.starts_with(begins));
      CHECK((i == 0 || file == first));
      first = file;
    }
  };
  check({path("walk.bvh")}, "walk.glb", "glTF");
  check({path("walk.bvh")}, "walk.VRMA", "glTF");
  check({staged_log(), "--stream", "a"}, "a.glb", "glTF");
  check({staged_log()}, "all.mcap", "\x89MCAP0\r\n");
}

TEST_CASE("convert says what a file for another program cannot hold") {
  const TempFolder folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const auto check = [&](std::vector<std::string> words, int code, const std::string& says) {
    words.insert(words.begin(), "convert");
    const ProgramOutcome outcome = posed(words);
    CHECK(outcome.code == code);
    INFO(outcome.err);
    CHECK(has(outcome.err, says));
    CHECK_FALSE(std::filesystem::exists(words.back()));
  };
  const auto walk = motion::make_walker({.seconds = 1.0, .rate_hz = 30.0}).value();
  REQUIRE(clip::write_bvh(walk, path("walk.bvh")));
  clip::HandClip hand;
  hand.time_s = {0.0, 0.01};
  hand.angles.resize(2);
  REQUIRE(clip::write_hand_csv(hand, path("hand.csv")));
  check({path("walk.bvh"), "--out", path("a.mcap")}, 2, "only a log becomes a .mcap");
  check({staged_log(), "--stream", "a", "--out", path("a.mcap")}, 2, "as a whole log");
  check({staged_log(), "--take", "1", "--out", path("a.mcap")}, 2, "as a whole log");
  check({staged_log(), "--stream", "c", "--out", path("a.glb")}, 2, "has no stream 'c'");
  check({path("hand.csv"), "--out", path("a.vrma")}, 1, "lacks bones");
  check({folder.write("no.plog", "no log").string(), "--out", path("a.mcap")}, 1, "no.plog");
}

}  // namespace posed::test
