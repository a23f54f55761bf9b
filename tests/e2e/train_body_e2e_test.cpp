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
  const auto synthesised = nlohmann::json::parse(performed.out);
  CHECK(synthesised["feet_off_cm"] < 1.0);
  CHECK(synthesised["states"][0]["leaf"].size() == 5);
  const auto clip = clip::read_clip(takes.file("both.bvh"));
  REQUIRE(clip.has_value());
  CHECK(clip->frames() == synthesised["frames"]);
  CHECK(one_sentence(synth({"--out", takes.file("x.bvh")}), 2, "name a clip of the body"));

  const auto eval = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"eval", "gesture", "--model", takes.file("b.gesture"), "--labels",
                               "raise-both rest"});
    return posed(std::move(more));
  };
  // Both arms of one take are kept back.
  const auto both = takes.file("both_real.bvh"), labels = takes.file("both_real.lab");
  REQUIRE(clip::write_bvh(raise_take({.left = true, .right = true, .take = 50}), both));
  REQUIRE(posed({"train", "gesture", "--auto-label", "--movement", "raise-both", "--body", "--clip",
                 both, "--out", labels})
              .code == 0);
  const auto bare = eval({"--json"});
  REQUIRE(bare.code == 0);
  CHECK_FALSE(nlohmann::json::parse(bare.out).contains("min_gap_cm"));
  const auto judged =
      eval({"--reference", both, "--reference-labels", labels, "--recorded", takes.clips[0],
            takes.clips[1], "--json", "--report", takes.file("eval.html")});
  INFO(judged.err);
  REQUIRE(judged.code == 0);
  const auto figures = nlohmann::json::parse(judged.out);
  CHECK(figures["feet_off_cm"] < 1.0);
  const auto& raised = figures["holds"]["labels"][0];
  CHECK(raised["label"] == "raise-both");
  CHECK(raised["recorded"] == false);
  CHECK(raised["groups"]["left-arm"]["deg"] < 5.0);
  // Nobody recorded both arms raised: the nearest pose has one of them down.
  CHECK(raised["nearest_recorded_deg"] > 20.0);
  CHECK(raised["constant_deg"] > 20.0);
  CHECK(raised["best_composition_deg"] < 5.0);
  CHECK(figures["reference"]["jerk_of_groups"]["left-arm"] > 0.0);
  const std::string page = file_text(takes.file("eval.html"));
  for (const char* there : {"composed group by group: raise-both", "left-arm: leftUpperArm about",
                            "All trees of left-arm", "Which gesture is recognised"}) {
    CHECK(page.find(there) != std::string::npos);
  }
  const auto reported = eval({"--reference", both, "--reference-labels", labels});
  CHECK(reported.code == 0);
  CHECK(reported.out.find("raise-both (new)") != std::string::npos);
  CHECK(one_sentence(eval({"--report", takes.file("y.html")}), 2, "add --reference TAKE.bvh"));
  CHECK(one_sentence(eval({"--reference", both, "--reference-labels",
                           takes.folder.write("x.lab", "0 1 jump\n").string()}),
                     2, "none of ... labels"));
}

TEST_CASE("A body's training draws its report", "[train_body]") {
  const ArmTakes takes;
  const auto trained = takes.train("a.gesture", {"--body", "--report", takes.file("a.html")});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  const std::string page = file_text(takes.file("a.html"));
  for (const char* there : {"as the model performs it", "A recording and the model",
                            "How long the states last", "Lag against error"}) {
    CHECK(page.find(there) != std::string::npos);
  }
}

TEST_CASE("A wave is cut at its cycles", "[train_body]") {
  const ArmTakes takes;
  REQUIRE(clip::write_bvh(raise_take({.right = true, .wave = true}), takes.file("wave.bvh")));
  const auto cut =
      posed({"train", "gesture", "--auto-label", "--movement", "wave", "--cycles", "--body",
             "--clip", takes.file("wave.bvh"), "--out", takes.file("wave.lab"), "--json"});
  INFO(cut.err);
  REQUIRE(cut.code == 0);
  CHECK(nlohmann::json::parse(cut.out)["segments"] > 5);
  CHECK(one_sentence(takes.train("x.gesture", {"--body", "--cycles"}), 2, "--cycles says how"));
  // A wave that is labelled whole is told of, and that one take is few.
  REQUIRE(posed({"train", "gesture", "--auto-label", "--movement", "wave", "--body", "--clip",
                 takes.file("wave.bvh"), "--out", takes.file("whole.lab")})
              .code == 0);
  const auto trained =
      posed({"train", "gesture", "--body", "--clip", takes.file("wave.bvh"), "--labels",
             takes.file("whole.lab"), "--out", takes.file("whole.gesture")});
  REQUIRE(trained.code == 0);
  CHECK(trained.err.find("label 'wave' swings") != std::string::npos);
  CHECK(trained.err.find("label 'wave' was recorded once only") != std::string::npos);
}

TEST_CASE("What no body can be learnt from is refused", "[train_body]") {
  const ArmTakes takes;
  const auto label = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"train", "gesture", "--auto-label", "--out", takes.file("x.lab"),
                               "--clip", takes.clips[0]});
    return posed(std::move(more));
  };
  CHECK(one_sentence(label({"--body"}), 2, "one movement"));
  CHECK(one_sentence(label({"--movement", "raise", "--labels", takes.labels[0]}), 2, "--movement"));
  CHECK(one_sentence(takes.train("x.gesture", {"--body", "--tree-text", "-", "--trees", "thumb"}),
                     2, "names no tree"));
  CHECK(one_sentence(takes.train("x.gesture", {"--movement", "raise"}), 2, "add --auto-label"));
  CHECK(one_sentence(takes.train("x.gesture", {"--body", "--none"}), 2, "leave out --none"));
  const auto asked = [&](const std::string& groups) {
    const auto file = takes.folder.write("asked.toml", groups).string();
    return takes.train("x.gesture", {"--questions", file});
  };
  const std::string lacking = "[a]\njoints = [\"hips\", \"upperChest\"]\nA = [\"rest\"]\n";
  CHECK(one_sentence(asked(lacking), 1, "upperChest"));
  CHECK(one_sentence(asked("[arm]\njoints = []\nA = [\"rest\"]\n"), 2, "has no joints"));
  CHECK(one_sentence(asked("[a]\njoints = [\"hips\"]\nA = [\"rest\"]\n"
                           "[b]\njoints = [\"hips\"]\nA = [\"rest\"]\n"),
                     2, "groups overlap"));
  // A skeleton without toes or feet among the others is refused in both orders.
  std::string lame = file_text(takes.clips[0]);
  for (std::size_t at = 0; (at = lame.find("JOINT LeftFoot", at)) != std::string::npos;) {
    lame.replace(at, 14, "JOINT LeftTwist");
  }
  const auto other = takes.folder.write("lame.bvh", lame).string();
  for (const bool first : {true, false}) {
    const std::string& valid = takes.clips[1];
    CHECK(one_sentence(
        posed({"train", "gesture", "--body", "--clip", first ? other : valid, first ? valid : other,
               "--labels", takes.labels[0], takes.labels[1], "--out", takes.file("x.gesture")}),
        1, "leftFoot"));
  }
  CHECK_FALSE(std::filesystem::exists(takes.file("x.gesture")));
}

}  // namespace posed::test
