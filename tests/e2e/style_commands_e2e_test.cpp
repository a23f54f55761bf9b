// train, apply and eval of a style with the real binary: no option is silently ignored, useless
// input is refused, the last line is a verdict, and the exit code agrees with it.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

using motion::WalkerFamily;
using nlohmann::json;

// Two synthetic walkers of each family, and an experiment file with the first of each.
struct WalkerStudio {
  TempFolder folder;

  WalkerStudio() {
    for (const std::uint32_t person : {1U, 2U}) {
      write("march_" + std::to_string(person), WalkerFamily::kMarch, person);
      write("sway_" + std::to_string(person), WalkerFamily::kSway, person);
    }
    folder.write(
        "exp.toml",
        "target = \"sway\"\n[[clip]]\nfile = \"march_1.bvh\"\ngroup = \"march\"\nmotion = "
        "\"walk\"\n[[clip]]\nfile = \"sway_1.bvh\"\ngroup = \"sway\"\nmotion = \"walk\"\n");
  }

  void write(const std::string& name, WalkerFamily family, std::uint32_t person) const {
    const auto clip = motion::make_walker({.family = family, .person = person});
    REQUIRE(clip::write_bvh(*clip, folder.path() / (name + ".bvh")));
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }
  [[nodiscard]] std::string bytes(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] bool there(const std::string& name) const {
    return std::filesystem::exists(path(name));
  }

  // Runs `train style` with the arguments `what` and writes `out`.
  [[nodiscard]] ProgramOutcome train(std::vector<std::string> what, const std::string& out) const {
    what.insert(what.begin(), {"train", "style"});
    what.insert(what.end(), {"--out", path(out), "--json"});
    return posed(std::move(what));
  }
  // From the first march to the first sway, into m.style.
  [[nodiscard]] ProgramOutcome march_to_sway() const {
    return train({"--from", path("march_1.bvh"), "--to", path("sway_1.bvh")}, "m.style");
  }
  [[nodiscard]] ProgramOutcome experiment(std::vector<std::string> more,
                                          const std::string& out) const {
    more.insert(more.begin(), {"--experiment", path("exp.toml")});
    return train(std::move(more), out);
  }
  [[nodiscard]] ProgramOutcome eval(const std::string& source, const std::string& target) const {
    return posed({"eval", "style", "--model", path("m.style"), "--source", path(source), "--target",
                  path(target), "--json"});
  }
};

}  // namespace

TEST_CASE("command line options beside an experiment file override it or are refused",
          "[train_style]") {
  const WalkerStudio studio;
  const auto usual = studio.experiment({}, "default.style");
  REQUIRE(usual.code == 0);
  CHECK(json::parse(usual.out)["mode"] == "default");
  const auto paper = studio.experiment({"--mode", "paper"}, "paper.style");
  REQUIRE(paper.code == 0);
  CHECK(json::parse(paper.out)["mode"] == "paper");
  CHECK(json::parse(paper.out)["kernel"]["length_chosen_by"] == "evidence");
  const auto other =
      studio.experiment({"--rate", "60", "--pose-space", "humanoid"}, "humanoid.style");
  REQUIRE(other.code == 0);
  CHECK(json::parse(other.out)["rate_hz"] == 60.0);
  CHECK(json::parse(other.out)["pose_space"] == "humanoid");

  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    const auto done = studio.experiment(std::move(more), "x.style");
    return done.code == 2 && has(done.err, why) && !studio.there("x.style");
  };
  CHECK(refused({"--mode", "papr"}, "choose default or paper"));
  CHECK(refused({"--pose-space", "humanoids"}, "humanoid"));
  CHECK(refused({"--motion", "walk"}, "leave out --motion"));
  CHECK(refused({"--skeleton", "02.asf"}, "for AMC clips"));
  const auto help = posed({"train", "style", "--help"});
  for (const char* key : {"mode = ", "rate_hz = ", "pose_space = ", "skeleton = "}) {
    CHECK(has(help.out, key));
  }
}

TEST_CASE("several targets make one model, whose styles weights mix and a mask takes from parts",
          "[train_style]") {
  const WalkerStudio studio;
  const auto done =
      studio.train({"--from", studio.path("march_1.bvh"), studio.path("march_2.bvh"), "--to",
                    "sway=" + studio.path("sway_1.bvh"), "other=ann:" + studio.path("sway_2.bvh")},
                   "two.style");
  INFO(done.err);
  REQUIRE(done.code == 0);
  const json report = json::parse(done.out);
  REQUIRE(report["targets"].size() == 2);
  CHECK(report["targets"][0]["name"] == "sway");
  CHECK(report["targets"][1]["name"] == "other");
  CHECK(has(done.err, "other: "));

  const auto apply = [&](std::vector<std::string> more, const std::string& out) {
    more.insert(more.begin(), {"apply", "--model", studio.path("two.style"), "--json",
                               studio.path("march_1.bvh"), "--out", studio.path(out)});
    return posed(std::move(more));
  };
  REQUIRE(apply({}, "plain.bvh").code == 0);
  REQUIRE(apply({"--weights", "sway=2"}, "first.bvh").code == 0);
  const auto mixed = apply({"--weights", "sway=3,other=1", "--mask", "arms=0"}, "mixed.bvh");
  REQUIRE(mixed.code == 0);
  CHECK(json::parse(mixed.out)["weights"]["sway"] == 0.75);
  CHECK(json::parse(mixed.out)["weights"]["other"] == 0.25);
  CHECK(studio.bytes("plain.bvh") == studio.bytes("first.bvh"));
  CHECK(studio.bytes("plain.bvh") != studio.bytes("mixed.bvh"));

  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    const auto tried = apply(std::move(more), "x.bvh");
    INFO(tried.err);
    CHECK(has(tried.err, why));
    return tried.code == 2 && !studio.there("x.bvh");
  };
  CHECK(refused({"--weights", "sad=1"}, "'sad' ... sway, other"));
  CHECK(refused({"--weights", "sway=0"}, "all are 0"));
  CHECK(refused({"--mask", "tail=1"}, "'tail' ... arms, legs"));
  const auto early = studio.train({"--from", studio.path("march_1.bvh"), "--to",
                                   studio.path("sway_1.bvh"), "sway=" + studio.path("sway_2.bvh")},
                                  "x.style");
  CHECK(early.code == 2);
  CHECK(has(early.err, "before the first NAME="));
}

TEST_CASE("files are takes of one person unless a name before a colon tells them apart",
          "[train_style]") {
  const WalkerStudio studio;
  const auto subjects = [&](const std::vector<std::string>& from, const std::string& to) {
    std::vector<std::string> what{"--from"};
    what.insert(what.end(), from.begin(), from.end());
    what.insert(what.end(), {"--to", to, "--overwrite"});
    const auto done = studio.train(what, "people.style");
    REQUIRE(done.code == 0);
    json report = json::parse(done.out);
    std::vector<std::string> names;
    for (const json& clip : report["clips"]) names.push_back(clip["subject"]);
    return std::pair{names, report["warnings"].dump()};
  };
  const std::string march = studio.path("march_1.bvh");
  const std::string other = studio.path("march_2.bvh");
  const std::string sway = studio.path("sway_1.bvh");
  const auto [one, silent] = subjects({march, other}, sway);
  CHECK(one == std::vector<std::string>(3, "one person"));
  CHECK(silent == "[]");
  const auto [two, still_silent] = subjects({"ann:" + march, "bob:" + other}, "ann:" + sway);
  CHECK(two == std::vector<std::string>{"ann", "bob", "ann"});
  CHECK(still_silent == "[]");
  const auto [apart, warning] = subjects({"ann:" + march}, "bob:" + sway);
  CHECK(has(warning, "'from' ... 'to' ... walk"));
  // A file whose own name has a colon is that file.
  studio.write("eve:1", WalkerFamily::kMarch, 2);
  const auto [whole, none] = subjects({studio.path("eve:1.bvh")}, sway);
  CHECK(whole.front() == "one person");
}

TEST_CASE("no model is trained from useless data", "[train_style]") {
  const WalkerStudio studio;
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& why) {
    const auto done =
        studio.train({"--from", studio.path(from), "--to", studio.path(to)}, "x.style");
    return done.code == 1 && has(done.err, why) && !studio.there("x.style");
  };
  CHECK(refused("march_1.bvh", "march_1.bvh", "the same ... march_1.bvh"));
  const auto longer =
      motion::make_walker({.family = WalkerFamily::kMarch, .person = 1, .seconds = 7.0});
  REQUIRE(clip::write_bvh(*longer, studio.folder.path() / "again.bvh"));
  CHECK(refused("march_1.bvh", "again.bvh", "no difference"));
  // --force writes the model all the same and reports that.
  const auto forced = studio.train(
      {"--from", studio.path("march_1.bvh"), "--to", studio.path("again.bvh"), "--force"},
      "x.style");
  CHECK(forced.code == 0);
  CHECK(has(forced.err, "--force"));
  CHECK(studio.there("x.style"));
}

TEST_CASE("train, apply and eval end in a verdict; all degrees rms are one figure",
          "[train_style][apply][eval_style]") {
  const WalkerStudio studio;
  const auto trained = studio.march_to_sway();
  REQUIRE(trained.code == 0);
  CHECK(has(trained.err, "% of the difference to 'to'"));
  CHECK(has(trained.err, "a fixed change of the pose "));
  CHECK(json::parse(trained.out)["closes"] > 0.5);

  const auto stands = posed({"apply", "--model", studio.path("m.style"), studio.path("march_1.bvh"),
                             "--out", studio.path("stands.bvh"), "--json"});
  CHECK(json::parse(stands.out)["root"] == "stride");  // who says nothing gets feet that stand
  CHECK_FALSE(has(stands.err, "feet may slide"));
  const auto applied =
      posed({"apply", "--model", studio.path("m.style"), "--root", "off",
             studio.path("march_1.bvh"), "--out", studio.path("out.bvh"), "--json"});
  REQUIRE(applied.code == 0);
  const auto change = json::parse(applied.out);
  CHECK(change["far_from_training"] == false);
  CHECK(has(applied.err, "like those of the training"));
  CHECK(has(applied.err, "feet may slide"));  // every sentence, with --json too

  const auto judged = studio.eval("march_1.bvh", "sway_1.bvh");
  REQUIRE(judged.code == 0);
  const auto score = json::parse(judged.out);
  CHECK(score["moved_rms_deg"].get<double>() ==
        Approx(change["rms_change_deg"].get<double>()).epsilon(1e-9));
  CHECK(score["component_rms_deg"] < score["moved_rms_deg"]);
  CHECK(score["constant_cycle_ratio"] > score["cycle_ratio"]);
  CHECK(has(judged.err, "of the difference ... fixed change of the pose"));

  // For people the verdict comes first; a walker who was not taught gets most of what was.
  const auto told = posed({"eval", "style", "--model", studio.path("m.style"), "--source",
                           studio.path("march_1.bvh"), "--target", studio.path("sway_1.bvh"),
                           "--neutral", studio.path("march_2.bvh")});
  CHECK(told.code == 0);
  CHECK(has(told.out.substr(0, told.out.find('\n')), "a walker who was not taught misses"));
  CHECK_FALSE(has(told.out, "cycle_ratio"));

  // Compared with another march, the sway style only increases the distance.
  const auto worse = studio.eval("march_1.bvh", "march_2.bvh");
  CHECK(worse.code == 1);
  CHECK(json::parse(worse.out)["helps"] == false);
  CHECK(has(worse.err, "worse than nothing"));

  // So little style that the verdict would say 0 %: the exit code agrees.
  const auto nothing = posed({"eval", "style", "--model", studio.path("m.style"), "--source",
                              studio.path("march_1.bvh"), "--target", studio.path("sway_1.bvh"),
                              "--alpha", "0.002", "--json"});
  CHECK(nothing.code == 1);
  const auto figures = json::parse(nothing.out);
  CHECK(figures["cycle_ratio"] < 1.0);
  CHECK(figures["helps"] == false);
  CHECK(has(nothing.err, "no better than nothing"));
}

TEST_CASE("apply says that it changed nothing, and eval mixes styles as apply tells", "[apply]") {
  const WalkerStudio studio;
  REQUIRE(studio.march_to_sway().code == 0);
  const auto apply = [&](const std::string& alpha) {
    return posed({"apply", "--model", studio.path("m.style"), "--alpha", alpha, "--overwrite",
                  studio.path("march_2.bvh"), "--out", studio.path("out.bvh"), "--json"});
  };
  const auto none = apply("0");
  CHECK(none.code == 0);
  CHECK(has(none.err, "warning: ... --alpha is 0"));
  CHECK(json::parse(none.out)["unchanged"] == "no joint was changed, because --alpha is 0");
  const auto some = apply("1");
  CHECK_FALSE(has(some.err, "no joint was changed"));
  CHECK(json::parse(some.out)["unchanged"].is_null());
  const auto judged = studio.eval("march_2.bvh", "sway_2.bvh");
  CHECK(json::parse(judged.out)["weights"] == json::parse(some.out)["weights"]);
  CHECK(json::parse(judged.out)["weights"].is_object());
}

TEST_CASE("apply --gate stands anywhere, alone or with on or off", "[apply]") {
  const WalkerStudio studio;
  REQUIRE(studio.march_to_sway().code == 0);
  const std::string model = studio.path("m.style");
  const std::string in = studio.path("march_2.bvh");
  const std::string out = studio.path("out.bvh");
  const std::vector<std::vector<std::string>> orders{
      {in, "--out", out, "--gate"},         {in, "--gate", "--out", out},
      {"--gate", "--out", out, in},         {"--out", out, "--gate", in},
      {"--gate=on", in, "--out", out},      {in, "--out", out, "--gate", "off"},
      {in, "--out", out, "--gate", "ajar"},
  };
  std::vector<int> codes;
  for (std::vector<std::string> order : orders) {
    order.insert(order.begin(), {"apply", "--model", model, "--overwrite", "--json"});
    codes.push_back(posed(order).code);
  }
  CHECK(codes == std::vector<int>{0, 0, 0, 0, 0, 0, 2});
}

TEST_CASE("apply --neutral is refused where the clip shows no walk", "[apply]") {
  const WalkerStudio studio;
  REQUIRE(studio.march_to_sway().code == 0);
  auto still = motion::make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  still.channels.rowwise() = Eigen::RowVectorXd(still.channels.row(0));
  REQUIRE(clip::write_bvh(still, studio.folder.path() / "still.bvh"));
  const auto apply_neutral = [&](const char* neutral) {
    return posed({"apply", "--model", studio.path("m.style"), "--overwrite", "--out",
                  studio.path("out.bvh"), studio.path("still.bvh"), "--neutral",
                  studio.path(neutral)});
  };
  const auto still_neutral = apply_neutral("still.bvh");
  CHECK(still_neutral.code == 1);
  CHECK(has(still_neutral.err, "shows no walk"));
  CHECK(apply_neutral("march_2.bvh").code == 0);
}

TEST_CASE("apply says that a walker is far from the training", "[apply]") {
  const WalkerStudio studio;
  REQUIRE(studio.march_to_sway().code == 0);
  auto bent = motion::make_walker({.family = WalkerFamily::kMarch, .person = 1}).value();
  bent.channels.rightCols(bent.channels.cols() - 6).array() += 0.4;
  REQUIRE(clip::write_bvh(bent, studio.folder.path() / "bent.bvh"));
  const auto applied = posed({"apply", "--model", studio.path("m.style"), studio.path("bent.bvh"),
                              "--out", studio.path("out.bvh"), "--json"});
  CHECK(applied.code == 0);
  CHECK(json::parse(applied.out)["far_from_training"] == true);
  CHECK(has(applied.err, "warning: ... far from the training"));
}

TEST_CASE("no command destroys a file: wrong names, inputs and files that exist are refused",
          "[output]") {
  const WalkerStudio studio;
  REQUIRE(studio.march_to_sway().code == 0);
  const std::string model = studio.bytes("m.style");
  const std::string walk = studio.bytes("march_1.bvh");
  const auto apply = [&](const std::string& out, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"apply", "--model", studio.path("m.style"),
                               studio.path("march_1.bvh"), "--out", studio.path(out)});
    return posed(std::move(more));
  };
  const auto refused = [&](const ProgramOutcome& done, const std::string& why) {
    return done.code == 2 && has(done.err, why);
  };
  CHECK(refused(apply("out.csv"), "does not end in .bvh"));
  CHECK_FALSE(studio.there("out.csv"));
  CHECK(refused(apply("march_1.bvh", {"--overwrite"}), "is read by this command"));
  CHECK(refused(apply("sway_1.bvh"), "add --overwrite"));
  CHECK(apply("sway_1.bvh", {"--overwrite"}).code == 0);
  CHECK(refused(studio.experiment({}, "m.style"), "add --overwrite"));
  CHECK(refused(studio.experiment({"--overwrite"}, "exp.toml"), "does not end in .style"));
  CHECK(refused(posed({"convert", studio.path("march_1.bvh"), "--out", studio.path("march_1.bvh"),
                       "--overwrite"}),
                "is read by this command"));
  CHECK(refused(
      posed({"convert", studio.path("march_1.bvh"), "--rate", "60", "--out", studio.path("c.bvh")}),
      "only AMC accepts a rate"));
  CHECK(studio.bytes("m.style") == model);
  CHECK(studio.bytes("march_1.bvh") == walk);
}

}  // namespace posed::test
