// `posed synth` with the real binary: its output formats, its errors, and an independent program
// that solves the same model file.
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::test {
namespace {

constexpr const char* kString = "g 1 c 3 4 p";

// A folder with a model.
struct ModelFolder {
  TempFolder folder;
  std::string model = (folder.path() / "toy.gesture").string();

  ModelFolder() { REQUIRE(gesture::save_model(toy_gesture_model(), model).has_value()); }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }
  ProgramOutcome synth(const std::string& labels, const std::string& out,
                       std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments{"synth", "--model", model,     "--labels",
                                       labels,  "--out",   path(out), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return posed(std::move(arguments));
  }
};

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  REQUIRE(pipe);
  std::string said;
  for (char part[4096]; std::fgets(part, sizeof part, pipe.get()) != nullptr;) said += part;
  return said;
}

TEST_CASE("synth reports its states and keeps fingers apart, as CSV and as BVH") {
  const ModelFolder studio;
  for (const std::string out : {"hand.csv", "hand.bvh"}) {
    const ProgramOutcome made = studio.synth(kString, out, {"--hand", "left"});
    REQUIRE(made.code == 0);
    const auto report = nlohmann::json::parse(made.out);
    REQUIRE(report["states"].size() == 30);
    int start = 0;
    for (const auto& state : report["states"]) {
      CHECK(state["start"] == start);
      start += state["frames"].get<int>();
    }
    CHECK(report["frames"] == start);
    CHECK(report["states"][5]["label"] == "1");
    CHECK(report["states"][5]["state"] == 1);
    CHECK(report["states"][5]["leaf"]["index"] == 2);
    CHECK(report["min_gap_cm"] >= 0.0);
    const auto clip = clip::read_hand_clip(studio.path(out));
    REQUIRE(clip.has_value());
    CHECK(static_cast<int>(clip->angles.size()) == start);
  }
}

TEST_CASE("an independent program solves the model file to the same trajectory") {
  const ModelFolder studio;
  REQUIRE(studio.synth(kString, "hand.csv", {"--unconstrained"}).code == 0);
  const auto ours = clip::read_hand_clip(studio.path("hand.csv"));
  REQUIRE(ours.has_value());
  const auto schema = posed_binary().parent_path() / "python";
  std::istringstream theirs(output_of("timeout 120 /usr/bin/python3 " +
                                      (source_dir() / "tests/e2e/solve_gesture.py").string() + " " +
                                      schema.string() + " " + studio.model + " '" + kString + "'"));
  double worst_rad = 0.0;
  std::size_t frame = 0;
  for (std::string line; std::getline(theirs, line); ++frame) {
    REQUIRE(frame < ours->angles.size());
    std::istringstream fields(line);
    std::string field;
    for (int c = 0; c < kHandChannels && std::getline(fields, field, ','); ++c) {
      worst_rad = std::max(worst_rad, std::abs(std::stod(field) - ours->angles[frame][c]));
    }
  }
  CHECK(frame == ours->angles.size());
  CHECK(worst_rad < 1e-6);
}

TEST_CASE("synth refuses what it cannot perform with one error message and exit code 2") {
  const ModelFolder studio;
  const ProgramOutcome unknown = studio.synth("g 7", "hand.csv");
  CHECK(unknown.code == 2);
  CHECK(unknown.err.find("unknown label(s) 7") != std::string::npos);
  CHECK(studio.synth("", "hand.csv").code == 2);
  CHECK(studio.synth("g", "hand.mp4").code == 2);
  CHECK(studio.synth("g", "hand.csv", {"--lookahead", "soon"}).code == 2);
  CHECK(studio.synth("g", "hand.csv", {"--tempo", "0"}).code == 2);
  CHECK(studio.synth("g", "hand.csv", {"--lookahead", "15", "--tempo", "2"}).code == 0);
  // An existing file is not replaced without --overwrite.
  CHECK(studio.synth("g", "hand.csv").code == 2);
  CHECK(studio.synth("g", "hand.csv", {"--overwrite"}).code == 0);
}

}  // namespace
}  // namespace posed::test
