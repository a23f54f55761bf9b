// Gestures of a body with the real binary: takes of one movement label themselves, train a model,
// and a movement that was never recorded is performed.
#include <filesystem>

#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "proto/clip/clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/arm_raiser.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// Takes of raised arms as BVH, with their label files.
struct ArmTakes {
  TempFolder folder;
  std::vector<std::string> clips, labels;

  ArmTakes() {
    for (std::uint32_t take = 1; take <= 4; ++take) {
      add({.left = true, .take = take}, "left" + std::to_string(take));
      add({.right = true, .take = 10 + take}, "right" + std::to_string(take));
    }
  }

  void add(const Raise& raise, const std::string& name) {
    clips.push_back(file(name + ".bvh"));
    labels.push_back(file(name + ".lab"));
    REQUIRE(clip::write_bvh(raise_take(raise), clips.back()));
    const auto labelled = posed({"train", "gesture", "--auto-label", "--movement",
                                 raise.left ? "raise-left" : "raise-right", "--body", "--clip",
                                 clips.back(), "--out", labels.back()});
    INFO(labelled.err);
    REQUIRE(labelled.code == 0);
  }

  [[nodiscard]] std::string file(const std::string& name) const {
    return (folder.path() / name).string();
  }

  [[nodiscard]] ProgramOutcome train(const std::string& out,
                                     const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"train", "gesture", "--out", file(out), "--clip"};
    arguments.insert(arguments.end(), clips.begin(), clips.end());
    arguments.emplace_back("--labels");
    arguments.insert(arguments.end(), labels.begin(), labels.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return posed(std::move(arguments));
  }
};

}  // namespace

TEST_CASE("Raised arms are learnt, and both are raised", "[train_body]") {
  const ArmTakes takes;
  const auto proposed =
      takes.train("a.gesture", {"--body", "--propose-questions", takes.file("q.toml"), "--json"});
  INFO(proposed.err);
  REQUIRE(proposed.code == 0);
  const auto report = nlohmann::json::parse(proposed.out);
  CHECK(report["body"] == true);
  CHECK(report["groups"].size() == 5);
  CHECK(report["labels"].size() == 3);
  std::string questions = file_text(takes.file("q.toml"));
  // Where the left arm is raised in raise-left, it is in raise-both, too; the same on the right.
  for (const char* arm : {"\"raise-left\"]", "\"raise-right\"]"}) {
    const auto at = questions.find(
        arm, questions.find(arm == std::string("\"raise-left\"]") ? "[left-arm]" : "[right-arm]"));
    REQUIRE(at != std::string::npos);
    questions.insert(at, "\"raise-both\", ");
  }
  for (const char* group : {"[head]", "[legs]", "[trunk]"}) {
    questions.insert(questions.find("A = [", questions.find(group)) + 5, "\"raise-both\", ");
  }
  const auto asked = takes.folder.write("asked.toml", questions).string();
  const auto trained = takes.train("b.gesture", {"--questions", asked, "--tree-text",
                                                 takes.file("t.txt"), "--trees", "left-arm:3"});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  CHECK(trained.out.find("left-arm") != std::string::npos);
  CHECK(file_text(takes.file("t.txt")).find("state 3, left-arm") == 0);
  REQUIRE(takes.train("c.gesture", {"--questions", asked}).code == 0);
  CHECK(file_text(takes.file("b.gesture")) == file_text(takes.file("c.gesture")));

  const auto synth = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"synth", "--model", takes.file("b.gesture"), "--labels",
                               "raise-both rest", "--json", "--overwrite"});
    return posed(std::move(more));
  };
  const auto performed = synth({"--body", takes.clips[0], "--out", takes.file("both.bvh")});
  INFO(performed.err);
  REQUIRE(performed.code == 0);
  const auto told = nlohmann::json::parse(performed.out);
  CHECK(told["feet_off_cm"] < 1.0);
  CHECK(told["states"][0]["leaf"].size() == 5);
  const auto clip = clip::read_clip(takes.file("both.bvh"));
  REQUIRE(clip.has_value());
  CHECK(clip->frames() == told["frames"]);
  CHECK(one_sentence(synth({"--out", takes.file("x.bvh")}), 2, "name a clip of the body"));
  CHECK(one_sentence(posed({"eval", "gesture", "--model", takes.file("b.gesture")}), 2,
                     "the model is of a body"));
}

TEST_CASE("What no body can be learnt from is refused", "[train_body]") {
  const ArmTakes takes;
  const auto label = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"train", "gesture", "--auto-label", "--out", takes.file("x.lab"),
                               "--clip", takes.clips[0]});
    return posed(std::move(more));
  };
  CHECK(one_sentence(label({"--body"}), 2, "names a take's one movement"));
  CHECK(one_sentence(label({"--movement", "raise", "--labels", takes.labels[0]}), 2, "--movement"));
  const auto sample = (source_dir() / "config/gestures/raise-arms.toml").string();
  CHECK(one_sentence(takes.train("x.gesture", {"--questions", sample}), 1,
                     "the skeleton has no leftToes"));
  CHECK(one_sentence(takes.train("x.gesture", {"--body", "--report", takes.file("x.html")}), 2,
                     "--report draws the gestures of hands"));
  CHECK(one_sentence(takes.train("x.gesture", {"--body", "--tree-text", "-", "--trees", "thumb"}),
                     2, "names no tree"));
  CHECK(one_sentence(takes.train("x.gesture", {"--movement", "raise"}), 2, "add --auto-label"));
  CHECK_FALSE(std::filesystem::exists(takes.file("x.gesture")));
}

}  // namespace posed::test
