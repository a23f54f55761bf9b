// `posed eval natural` with the real binary: bodies, hands and AMC beside a folder of clips; what
// is left out is told, what cannot be judged is one sentence and an exit code.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

using motion::WalkerFamily;
using nlohmann::json;

struct Corpus {
  TempFolder folder;

  explicit Corpus(std::uint32_t marchers = 0) {
    std::filesystem::create_directory(path("corpus"));
    for (std::uint32_t person = 1; person <= marchers; ++person) {
      walk("corpus/" + std::to_string(person) + ".bvh", {WalkerFamily::kMarch, person});
    }
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }
  void walk(const std::string& name, const motion::WalkerOptions& options) const {
    REQUIRE(clip::write_bvh(*motion::make_walker(options), path(name)));
  }
  [[nodiscard]] ProgramOutcome judge(const std::string& clip, std::vector<std::string> more = {},
                                     const std::string& corpus = "corpus") const {
    more.insert(more.begin(), {"eval", "natural", path(clip), "--corpus", path(corpus)});
    return posed(std::move(more));
  }
};

// AMC clips whose one bone swings in a frame of axes that differs from subject to subject.
struct AmcCorpus : Corpus {
  AmcCorpus() {
    std::filesystem::create_directory(path("away"));
    subject("away/07", 60);
    swing("07_01.amc", 0.0);
    for (int s = 1; s <= 4; ++s) {
      const std::string name = "corpus/" + std::to_string(10 + s);
      subject(name, 10 * s);
      swing(name + "_01.amc", 0.3 * s);
    }
  }
  void subject(const std::string& name, int axis_deg) const {
    std::ofstream(path(name + ".asf"))
        << ":units\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n"
           " position 0 0 0\n orientation 0 0 0\n:bonedata\n begin\n  id 1\n  name thigh\n"
           "  direction 0 -1 0\n  length 8\n  axis 0 0 "
        << axis_deg << " XYZ\n  dof rx rz\n end\n:hierarchy\n begin\n  root thigh\n end\n";
  }
  void swing(const std::string& name, double start) const {
    std::ofstream file(path(name));
    file << ":FULLY-SPECIFIED\n:DEGREES\n";
    for (int t = 0; t < 480; ++t) {  // at 120 Hz
      const double phase = start + t * 0.05;
      file << t + 1 << "\nroot 0 17 " << 0.1 * t << " 0 0 0\nthigh " << 30.0 * std::sin(phase)
           << ' ' << 10.0 * std::cos(phase) << '\n';
    }
  }
};

// Hands of signers: recordings, or bodies that consist of a right hand.
struct HandCorpus : Corpus {
  HandCorpus() {
    std::filesystem::create_directory(path("bodies"));
    for (std::uint32_t person = 1; person <= 4; ++person) {
      const auto made = gesture::make_performance({.person = person, .gestures = 6});
      const std::string name = "corpus/" + std::to_string(person) + ".csv";
      REQUIRE(clip::write_hand_csv(made->clip, path(name)));
      const auto body = clip::clip_of_hand(made->clip, "adult");
      REQUIRE(clip::write_bvh(*body, path("bodies/" + std::to_string(person) + ".bvh")));
    }
  }
};

bool says(const ProgramOutcome& outcome, int code, const std::string& what) {
  UNSCOPED_INFO(outcome.code << ": " << outcome.out);
  return outcome.code == code && has(outcome.err, what);
}

// What the figures of the corpus are, whatever the clip is.
json spread_of(const ProgramOutcome& outcome) {
  json figures = json::parse(outcome.out)["figures"];
  for (json& figure : figures) figure = {figure["p5"], figure["median"], figure["p95"]};
  return figures;
}

}  // namespace

TEST_CASE("a clip is natural or not, and the exit code says which", "[eval_natural]") {
  const Corpus marchers(8);
  marchers.walk("another.bvh", {WalkerFamily::kMarch, 40});
  marchers.walk("trembling.bvh", {.family = WalkerFamily::kMarch, .person = 40, .noise_deg = 3.0});
  CHECK(says(marchers.judge("another.bvh"), 0, "natural by all"));
  const auto trembling = marchers.judge("trembling.bvh", {"--json"});
  CHECK(says(trembling, 1, "not natural: jerk is"));
  const json printed = json::parse(trembling.out);
  CHECK(printed["clips"] == 8);
  CHECK(printed["natural"] == false);
  CHECK(printed["figures"]["jerk"]["natural"] == false);
  CHECK(printed["figures"]["jerk"]["below"] == 1.0);
  CHECK(printed["left_out"].empty());
  const auto both = marchers.judge("another.bvh", {marchers.path("trembling.bvh"), "--json"});
  CHECK(says(both, 1, "another.bvh: natural by all ... trembling.bvh: not natural: jerk is"));
  const json list = json::parse(both.out);
  REQUIRE(list.size() == 2);
  CHECK(list[0]["natural"] == true);
  CHECK(list[1]["figures"] == printed["figures"]);
  CHECK(says(marchers.judge("another.bvh",
                            {marchers.path("trembling.bvh"), "--report", marchers.path("x.html")}),
             2, "--report is of one clip"));
}

TEST_CASE("the verdict of eval natural is a page, too", "[eval_natural]") {
  const Corpus marchers(4);
  marchers.walk("another.bvh", {WalkerFamily::kMarch, 40});
  const std::string page = marchers.path("natural.html");
  const auto judged = marchers.judge("another.bvh", {"--report", page});
  INFO(judged.err);
  std::ifstream file(page);
  const std::string html{std::istreambuf_iterator<char>(file), {}};
  CHECK(has(html, "natural"));
  CHECK(has(html, "beyond_deg"));
  CHECK(marchers.judge("another.bvh", {"--report", page}).code == 2);  // it is there already
}

TEST_CASE("what cannot be compared with is left out and told", "[eval_natural]") {
  const Corpus marchers(4);
  marchers.walk("corpus/5.bvh", {.family = WalkerFamily::kMarch, .person = 5, .seconds = 1.0});
  marchers.folder.write("corpus/6.bvh", "no clip");
  marchers.folder.write("corpus/notes.txt", "no clip either");
  const auto judged = marchers.judge("corpus/1.bvh", {"--json"});
  INFO(judged.err);
  const json printed = json::parse(judged.out);
  CHECK(printed["clips"] == 3);
  const json& left = printed["left_out"];
  REQUIRE(left.size() == 3);
  CHECK(left[0]["why"] == "it is the clip itself");
  CHECK(has(left[1]["why"].get<std::string>(), "too short"));
  CHECK(left[2]["file"] == marchers.path("corpus/6.bvh"));
  CHECK(has(marchers.judge("corpus/1.bvh").err, "3 clips left out: "));
  std::filesystem::remove(marchers.path("corpus/2.bvh"));
  CHECK(says(marchers.judge("corpus/1.bvh"), 1, "two clips can be compared with"));
}

TEST_CASE("wrong use of eval natural is one sentence", "[eval_natural]") {
  const Corpus marchers(3);
  CHECK(says(marchers.judge("corpus/1.bvh", {}, "nowhere"), 2, "is no folder that can be read"));
  CHECK(says(marchers.judge("corpus/1.bvh", {"--skeleton", "02.asf"}), 2, "only for AMC clips"));
  CHECK(marchers.judge("corpus/1.bvh", {"--hand", "third"}).code == 2);
  CHECK(marchers.judge("nothing.bvh").code != 0);
  std::filesystem::create_directory(marchers.path("empty"));
  CHECK(says(marchers.judge("corpus/1.bvh", {}, "empty"), 1, "holds no clip (.bvh, .amc"));
}

TEST_CASE("hands are judged beside hands, those of bodies with --hand", "[eval_natural]") {
  const HandCorpus signers;
  const auto hand = signers.judge("corpus/1.csv", {"--json"});
  INFO(hand.err);
  const json printed = json::parse(hand.out);
  CHECK(printed["clips"] == 3);
  CHECK(printed["figures"].contains("beyond_deg"));
  CHECK_FALSE(printed["figures"].contains("sink_cm"));
  const auto right = signers.judge("bodies/1.bvh", {"--hand", "right", "--json"}, "bodies");
  INFO(right.err);
  CHECK(json::parse(right.out)["clips"] == 3);
  // A hand beside the hands of bodies; without --hand these are bodies.
  CHECK(json::parse(signers.judge("corpus/1.csv", {"--hand", "right", "--json"}, "bodies").out)
            .at("clips") == 4);
  CHECK(says(signers.judge("corpus/1.csv", {}, "bodies"), 1, "holds no hand recording"));
  CHECK(signers.judge("bodies/1.bvh", {"--hand", "left"}, "bodies").code == 1);
}

TEST_CASE("a corpus of AMC has its own skeletons, not the one of the clip", "[eval_natural]") {
  const AmcCorpus corpus;
  CHECK(says(corpus.judge("07_01.amc"), 1, "name it with --skeleton"));
  const std::vector<std::string> named{"--json", "--skeleton", corpus.path("away/07.asf")};
  const auto judged = corpus.judge("07_01.amc", named);
  INFO(judged.err);
  REQUIRE(judged.out.starts_with("{"));
  std::filesystem::copy_file(corpus.path("away/07.asf"), corpus.path("07.asf"));
  CHECK(spread_of(judged) == spread_of(corpus.judge("07_01.amc", {"--json"})));
  // Where a clip has none beside it, the named one serves.
  std::filesystem::remove(corpus.path("corpus/11.asf"));
  CHECK(json::parse(corpus.judge("07_01.amc", {"--json"}).out)["clips"] == 3);
  const auto served = corpus.judge("07_01.amc", named);
  CHECK(json::parse(served.out)["clips"] == 4);
  CHECK_FALSE(spread_of(served) == spread_of(judged));
}

}  // namespace posed::test
