// `posed train gesture` with the real binary: a glove recording and its labels give a model, with
// the same bytes each time; labels are proposed; every mistake gives one error message and an exit
// code.

#include <chrono>
#include <filesystem>
#include <thread>

#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// A synthetic signer's recording with its labels, and a file with only the first labels.
struct Glove {
  TempFolder folder;
  std::string clip = (folder.path() / "take.csv").string();
  std::string labels = (folder.path() / "take.lab").string();
  std::string few = (folder.path() / "few.lab").string();

  explicit Glove(int gestures = 40) {
    const auto performance = gesture::make_performance({.gestures = gestures});
    REQUIRE(clip::write_hand_csv(performance->clip, clip));
    REQUIRE(clip::write_labels(performance->labels, labels));
    const auto& all = performance->labels;
    REQUIRE(clip::write_labels({all.begin() + 1, all.begin() + 8}, few));
  }

  [[nodiscard]] std::string file(const std::string& name) const {
    return (folder.path() / name).string();
  }

  // Runs `train gesture` with the recording, its labels and the arguments `more`.
  [[nodiscard]] ProgramOutcome train(const std::string& out, std::vector<std::string> more = {},
                                     const std::string& with = {}) const {
    std::vector<std::string> arguments{"train", "gesture",  "--clip",
                                       clip,    "--labels", with.empty() ? labels : with,
                                       "--out", file(out)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return posed(std::move(arguments));
  }
};

}  // namespace

TEST_CASE("A recording becomes a model, the same each time", "[train_gesture]") {
  const Glove glove;
  const auto first = glove.train(
      "a.gesture", {"--json", "--tree-svg", glove.file("t.svg"), "--trees", "middle:4"});
  REQUIRE(first.code == 0);
  const auto printed = nlohmann::json::parse(first.out);
  CHECK(printed["gestures"] == 40);
  CHECK(printed["leaves"] > 25);
  CHECK(printed["leaves_by_state"].size() == 5);
  CHECK(file_text(glove.file("t.svg")).find("state 4, middle") != std::string::npos);
  REQUIRE(glove.train("b.gesture").code == 0);
  CHECK(file_text(glove.file("a.gesture")) == file_text(glove.file("b.gesture")));
  const auto model = gesture::load_model(glove.file("a.gesture"));
  REQUIRE(model.has_value());
  CHECK(model->label_index("3") >= 0);
  CHECK_FALSE(model->tells_none);
  REQUIRE(glove.train("none.gesture", {"--none"}).code == 0);
  CHECK(gesture::load_model(glove.file("none.gesture"))->tells_none);
  // The documented questions are the built-in ones, in another order of labels.
  const auto sample = (source_dir() / "config/gestures/gcp134.toml").string();
  const auto asked = glove.train("c.gesture", {"--json", "--questions", sample});
  REQUIRE(asked.code == 0);
  CHECK(nlohmann::json::parse(asked.out)["leaves"] == printed["leaves"]);
}

TEST_CASE("A model is judged and drawn", "[eval_gesture]") {
  const Glove glove;
  REQUIRE(glove.train("a.gesture").code == 0);
  const auto eval = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"eval", "gesture", "--model", glove.file("a.gesture"), "--json"});
    return posed(std::move(more));
  };
  const auto judged = eval({"--labels", "g c p g", "--reference", glove.clip, "--svg",
                            glove.file("lag.svg"), "--tree-dot", glove.file("t.dot")});
  INFO(judged.err);
  REQUIRE(judged.code == 0);
  const auto printed = nlohmann::json::parse(judged.out);
  CHECK(printed["leaves"]["states"].size() == 5);
  CHECK(printed["min_gap_cm"] >= 0.0);
  CHECK(printed["reference"]["nearest_reference_deg"] < 10.0);
  CHECK(printed["reference"]["frechet"] > 0.0);
  for (const char* figure : {"jerk", "ldlj", "sparc"})
    CHECK(printed["performed"][figure].is_number());
  const auto& curve = printed["curve"];
  REQUIRE(curve.size() > 5);
  CHECK(curve.back()["channel_rms_deg"] < curve.front()["channel_rms_deg"]);
  CHECK(file_text(glove.file("lag.svg")).find("<svg") == 0);
  CHECK(file_text(glove.file("t.dot")).find("digraph") != std::string::npos);
  CHECK(one_sentence(eval({"--labels", "wave"}), 2, "wave"));
  CHECK(one_sentence(eval({"--trees", "toe:9", "--tree-text", "-"}), 2, "toe:9"));
}

TEST_CASE("Classes are proposed, and a pose shown once becomes a label", "[train_gesture]") {
  const Glove glove;
  const auto three = gesture::make_performance({.person = 1, .script = {"3"}});
  REQUIRE(clip::write_hand_csv(three->clip, glove.file("three.csv")));
  const auto trained =
      glove.train("a.gesture", {"--json", "--propose-questions", glove.file("q.toml"), "--show",
                                "drei=" + glove.file("three.csv")});
  REQUIRE(trained.code == 0);
  const auto labels = nlohmann::json::parse(trained.out)["labels"];
  CHECK(labels.size() == 4);
  CHECK(labels.back()["name"] == "drei");
  CHECK(file_text(glove.file("q.toml")).find("[middle]") != std::string::npos);
}

TEST_CASE("Labels are proposed from a few", "[train_gesture]") {
  const Glove glove;
  const auto proposed = glove.train("all.lab", {"--auto-label", "--json"}, glove.few);
  REQUIRE(proposed.code == 0);
  CHECK(nlohmann::json::parse(proposed.out)["segments"] == 40);
  const auto labels = clip::read_labels(glove.file("all.lab"));
  REQUIRE(labels.has_value());
  CHECK(labels->size() == 40);
}

TEST_CASE("Ctrl-C ends the training and writes nothing", "[train_gesture]") {
  const Glove glove(400);
  Process training({"train", "gesture", "--clip", glove.clip, "--labels", glove.labels,
                    "--embedded-rounds", "20", "--out", glove.file("x.gesture")});
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!has(training.errors(), "aligning gestures") && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  training.send(SIGINT);
  CHECK(training.rest().empty());
  CHECK(training.exit_code() == 1);
  CHECK(has(training.errors(), "stopped ... nothing was written"));
  CHECK_FALSE(std::filesystem::exists(glove.file("x.gesture")));
}

TEST_CASE("What cannot be trained from is refused", "[train_gesture]") {
  const Glove glove;
  const auto& folder = glove.folder;
  const auto with = [&](const std::string& text) {
    return glove.train("x.gesture", {}, folder.write("bad.lab", text).string());
  };
  CHECK(one_sentence(with("0 1 g\n0.5 2 c\n"), 1, "bad.lab:2: ... overlaps"));
  CHECK(one_sentence(with("0 1 g\n5 4 c\n"), 1, "bad.lab:2: ... ends where it starts"));
  CHECK(one_sentence(with("0 1 g\n1 1000 c\n"), 1, "bad.lab:2: ... 1000"));
  CHECK(one_sentence(with("0 0.1 g\n"), 1, "bad.lab:1: ... 3 frames"));
  CHECK(one_sentence(with("0 1 wave\n1 2 g\n"), 1, "'wave' ... class"));
  CHECK(one_sentence(glove.train("x.gesture", {"--questions", "none.toml"}), 2, "none.toml"));
  CHECK(one_sentence(glove.train("x.gesture", {"--trees", "toe"}), 2, "names no tree"));
  CHECK(one_sentence(glove.train("x.gesture", {"--trees", "middle"}), 2, "add --tree-text"));
  CHECK(one_sentence(glove.train("x.lab", {"--auto-label", "--questions", "q.toml"}), 2,
                     "--auto-label"));
  CHECK(one_sentence(glove.train("take.csv"), 2, "does not end in .gesture"));
  CHECK(one_sentence(glove.train("take.lab", {"--auto-label", "--overwrite"}), 2,
                     "is read by this command"));
  CHECK(one_sentence(glove.train("x.gesture", {"--show", "three"}), 2, "shows no pose"));
  CHECK(one_sentence(glove.train("x.gesture", {"--clip", "b.csv"}), 2, "one label file"));
  CHECK(
      one_sentence(posed({"apply", "--model", glove.file("x.gesture"), "a.bvh", "--out", "b.bvh"}),
                   1, "model ... No such file"));
  CHECK_FALSE(std::filesystem::exists(glove.file("x.gesture")));
  REQUIRE(glove.train("h.gesture").code == 0);
  CHECK(
      one_sentence(posed({"apply", "--model", glove.file("h.gesture"), "a.bvh", "--out", "b.bvh"}),
                   1, "not a style model"));
}

}  // namespace posed::test
