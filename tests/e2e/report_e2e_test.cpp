// `--report` of the commands that learn, judge and measure: a page that a parser reads, that loads
// nothing and says what `--json` prints.
#include <catch2/catch.hpp>

#include <filesystem>

#include <nlohmann/json.hpp>

#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

using motion::WalkerFamily;
using nlohmann::json;

struct ReportDesk {
  TempFolder folder;

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }
  void walk(const std::string& name, WalkerFamily family, std::uint32_t person) const {
    const auto clip = motion::make_walker({.family = family, .person = person});
    REQUIRE(clip::write_bvh(*clip, path(name)));
  }
  // The words of a page that passes every check.
  [[nodiscard]] std::string words(const std::string& page) const {
    Process python(Command(
        {"/usr/bin/python3", (source_dir() / "tests/e2e/check_report.py").string(), path(page)}));
    std::string words = python.rest();
    INFO(page << ": " << python.errors());
    REQUIRE(python.exit_code() == 0);
    return words;
  }
  // The page holds all that was printed.
  void check_page(const std::string& page, const std::string& printed) const {
    const std::string all = words(page);
    CHECK(has(all, printed.substr(0, printed.find_last_not_of('\n') + 1)));
  }
};

void refuses(const ProgramOutcome& outcome, const std::string& what) {
  INFO(outcome.err);
  CHECK(outcome.code == 2);
  CHECK(has(outcome.err, what));
}

}  // namespace

TEST_CASE("a style's training and evaluation draw their reports", "[report]") {
  const ReportDesk desk;
  desk.walk("march <1>.bvh", WalkerFamily::kMarch, 1);
  desk.walk("march_2.bvh", WalkerFamily::kMarch, 2);
  desk.walk("sway_1.bvh", WalkerFamily::kSway, 1);
  desk.walk("sway_2.bvh", WalkerFamily::kSway, 2);
  const std::vector<std::string> train{"train",
                                       "style",
                                       "--from",
                                       "a:" + desk.path("march <1>.bvh"),
                                       "b:" + desk.path("march_2.bvh"),
                                       "--to",
                                       "a:" + desk.path("sway_1.bvh"),
                                       "b:" + desk.path("sway_2.bvh"),
                                       "--json",
                                       "--out",
                                       desk.path("m.style"),
                                       "--report",
                                       desk.path("train.html")};
  const auto trained = posed(train);
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  desk.check_page("train.html", trained.out);
  const std::string words = desk.words("train.html");
  for (const char* there : {"Where the styles lie", "Mean cycles side by side",
                            "Paths of the poses", "joint by joint", "Choice of the kernel",
                            "Walkers left out", "Strides of the clips", "march <1>", "sway_2"}) {
    CHECK(has(words, there));
  }
  refuses(posed(train), "--overwrite");

  std::vector<std::string> eval{"eval",     "style",
                                "--model",  desk.path("m.style"),
                                "--source", desk.path("march <1>.bvh"),
                                "--target", desk.path("sway_1.bvh"),
                                "--json"};
  auto wrong = eval;
  wrong.emplace_back("--overwrite");
  CHECK(posed(wrong).code == 2);
  wrong.back() = "--report=" + desk.path("sway_1.bvh");
  refuses(posed(wrong), "does not end in .html");
  eval.push_back("--report=" + desk.path("eval.html"));
  const auto judged = posed(eval);
  INFO(judged.err);
  REQUIRE(judged.code == 0);
  desk.check_page("eval.html", judged.out);
  CHECK(has(desk.words("eval.html"), "constant offset"));
}

TEST_CASE("the paper's way of training shows its style points", "[report]") {
  const ReportDesk desk;
  desk.walk("march.bvh", WalkerFamily::kMarch, 1);
  desk.walk("sway.bvh", WalkerFamily::kSway, 1);
  const auto trained = posed({"train", "style", "--mode", "paper", "--force", "--from",
                              desk.path("march.bvh"), "--to", desk.path("sway.bvh"), "--out",
                              desk.path("m.style"), "--report", desk.path("paper.html")});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  CHECK(has(desk.words("paper.html"), "style points xi of motion walk"));
}

TEST_CASE("a gesture model's training and evaluation draw their reports", "[report]") {
  const ReportDesk desk;
  const auto performance = gesture::make_performance({.gestures = 30});
  REQUIRE(clip::write_hand_csv(performance->clip, desk.path("take.csv")));
  REQUIRE(clip::write_labels(performance->labels, desk.path("take.lab")));
  const auto trained =
      posed({"train", "gesture", "--clip", desk.path("take.csv"), "--labels", desk.path("take.lab"),
             "--json", "--out", desk.path("h.gesture"), "--report", desk.path("train.html")});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  desk.check_page("train.html", trained.out);
  const auto judged =
      posed({"eval", "gesture", "--model", desk.path("h.gesture"), "--reference",
             desk.path("take.csv"), "--reference-labels", desk.path("take.lab"), "--labels",
             "g 1 c 3 4 p", "--json", "--report", desk.path("eval.html")});
  INFO(judged.err);
  REQUIRE(judged.code == 0);
  desk.check_page("eval.html", judged.out);
  for (const char* page : {"train.html", "eval.html"}) {
    const std::string words = desk.words(page);
    for (const char* there :
         {"\"g 1 c 3 4 p\" as the model performs it", "A recording and the model",
          "never recorded, beside real poses", "Which gesture is recognised", "Lag against error",
          "How long the states last", "The decision tree of the middle finger in state 4"}) {
      CHECK(has(words, there));
    }
  }
  CHECK(json::parse(judged.out)["holds"]["deg"] < 10.0);
}

TEST_CASE("the benchmark of the pipeline draws its report", "[report]") {
  const ReportDesk desk;
  const auto measured = posed({"bench", "pipeline", "--seconds", "4", "--points", "20", "--json",
                               "--report", desk.path("pipeline.html")});
  INFO(measured.err);
  REQUIRE(measured.code == 0);
  CHECK(json::parse(measured.out)["pipeline"]["messages"] > 100);
  desk.check_page("pipeline.html", measured.out);
  CHECK(has(desk.words("pipeline.html"), "The pipeline's way in parts"));
}

TEST_CASE("the experiment of acted walks draws the paper's figures", "[report][real]") {
  const auto clips = shared("data/styles");
  if (!clips) SKIP_WITHOUT_SHARED();
  const ReportDesk desk;
  const auto file = desk.folder.path() / "acted-walks.toml";
  std::filesystem::copy_file(source_dir() / "config/experiments/acted-walks.toml", file);
  for (const auto& clip : std::filesystem::directory_iterator(*clips)) {
    std::filesystem::create_symlink(std::filesystem::canonical(clip.path()),
                                    desk.folder.path() / clip.path().filename());
  }
  const auto trained = posed({"train", "style", "--experiment", file.string(), "--out",
                              desk.path("acted.style"), "--report", desk.path("acted.html")});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  const std::string words = desk.words("acted.html");
  CHECK(has(words, "style points xi of motion walk"));
  CHECK(has(words, "actor 1, take 001"));
}

}  // namespace posed::test
