// The checks of a training's clips, on synthetic walkers and, where present, on real recordings.
#include "models/style/train/training_check.hpp"

#include <catch2/catch.hpp>

#include <cmath>

#include <nlohmann/json.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/judge/walker_fit.hpp"
#include "models/style/train/train.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using motion::WalkerFamily;
using nlohmann::json;

namespace {

clip::Clip walker_file(WalkerFamily family, std::uint32_t person) {
  auto clip = motion::make_walker({.family = family, .person = person}).value();
  clip.path = (family == WalkerFamily::kMarch ? "march_" : "sway_") + std::to_string(person);
  return clip;
}

style::TrainingClip lesson(clip::Clip clip, const std::string& group,
                           const std::string& motion = "walk") {
  const std::string subject = clip.path;
  return {std::move(clip), group, subject, motion};
}

Result<style::StyleModel> trained(const std::vector<style::TrainingClip>& clips) {
  style::TrainOptions options;
  options.target = "to";
  return style::train_style(clips, options);
}

json report_of(const std::vector<style::TrainingClip>& clips) {
  const auto model = trained(clips);
  REQUIRE(model);
  return json::parse(model->report_json);
}

bool has_problem(const json& report, const std::string& what) {
  UNSCOPED_INFO(report["problems"].dump());
  return report["usable"] == false && report["problems"].dump().contains(what) &&
         report["verdict"].get<std::string>().starts_with("unusable: ");
}

clip::Clip real(const std::string& name) {
  auto clip = clip::read_clip(*test::shared("data/styles/dataset-" + name + ".bvh"));
  REQUIRE(clip);
  return *std::move(clip);
}

json real_report(const std::string& from, const std::string& to, const std::string& motion) {
  return report_of({lesson(real(from), "from", motion), lesson(real(to), "to", motion)});
}

}  // namespace

TEST_CASE("two styles are learnt, and the verdict states how much of the distance is closed",
          "[style][check]") {
  const json report = report_of({lesson(walker_file(WalkerFamily::kMarch, 1), "from"),
                                 lesson(walker_file(WalkerFamily::kMarch, 2), "from"),
                                 lesson(walker_file(WalkerFamily::kSway, 3), "to")});
  CHECK(report["usable"] == true);
  CHECK(report["closes"] > 0.5);
  CHECK(report["closes"] > report["constant_closes"]);
  CHECK(report["closes_measured_on"] == "held-out clips");
  CHECK(report["difference_deg"] > 5.0);
  const auto verdict = report["verdict"].get<std::string>();
  CHECK(verdict.starts_with("learnt "));
  CHECK(verdict.contains("% of the difference to 'to', tested on motion it had not seen"));
  CHECK(verdict.contains("a fixed change of the pose would be "));
}

TEST_CASE("what sets two actors apart is no scatter of their takes", "[style][check]") {
  const auto by = [](const char* who, WalkerFamily family, std::uint32_t person) {
    const std::string group = family == WalkerFamily::kMarch ? "from" : "to";
    return style::TrainingClip{walker_file(family, person), group, who, "walk"};
  };
  std::vector<style::TrainingClip> clips;
  for (const std::uint32_t person : {1U, 2U}) {
    const char* who = person == 1 ? "ann" : "bob";
    clips.push_back(by(who, WalkerFamily::kMarch, person));
    clips.push_back(by(who, WalkerFamily::kSway, person));
  }
  CHECK(report_of(clips)["scatter_deg"] == 0.0);
  clips.push_back(by("bob", WalkerFamily::kMarch, 3));
  CHECK(report_of(clips)["scatter_deg"] > 0.0);
}

TEST_CASE("one recording in two groups is refused by name", "[style][check]") {
  const auto march = walker_file(WalkerFamily::kMarch, 1);
  const auto model = trained({lesson(march, "from"), lesson(march, "to")});
  REQUIRE_FALSE(model);
  CHECK(model.error().message.contains("is the same recording as march_1"));
}

TEST_CASE("a recording that is twice in its group counts once, and the take is named",
          "[style][check]") {
  const auto march = walker_file(WalkerFamily::kMarch, 1);
  const auto sway = walker_file(WalkerFamily::kSway, 1);
  CHECK(report_of({lesson(march, "from"), lesson(march, "from"), lesson(sway, "to")})["clips"]
            .size() == 2);
}

TEST_CASE("takes in the wrong group are named, and several people are asked for",
          "[style][check]") {
  const auto take = [](WalkerFamily family, std::uint32_t person, double seconds,
                       const std::string& group) {
    auto clip =
        motion::make_walker({.family = family, .person = person, .seconds = seconds}).value();
    clip.path = (family == WalkerFamily::kMarch ? "march_" : "sway_") + std::to_string(person);
    if (person == 2) clip.channels.rightCols(clip.channels.cols() - 6).array() += 0.15;
    return style::TrainingClip{std::move(clip), group, "ann", "walk"};
  };
  const auto warnings_of = [&](WalkerFamily third, WalkerFamily sixth, std::uint32_t person) {
    return report_of({take(WalkerFamily::kMarch, 1, 6.0, "from"),
                      take(WalkerFamily::kMarch, 1, 7.0, "from"), take(third, person, 8.0, "from"),
                      take(WalkerFamily::kSway, 1, 6.0, "to"),
                      take(WalkerFamily::kSway, 1, 7.0, "to"),
                      take(sixth, person, 8.0, "to")})["warnings"]
        .dump();
  };
  const auto right = warnings_of(WalkerFamily::kMarch, WalkerFamily::kSway, 1);
  CHECK_FALSE(right.contains("nearer"));
  CHECK_FALSE(right.contains("several people"));
  const auto wrong = warnings_of(WalkerFamily::kSway, WalkerFamily::kMarch, 1);
  INFO(wrong);
  CHECK(wrong.contains("sway_1 is in 'from', but nearer to a take of 'to'"));
  CHECK(wrong.contains("march_1 is in 'to', but nearer to a take of 'from'"));
  CHECK_FALSE(wrong.contains("several people"));
  const auto two = warnings_of(WalkerFamily::kMarch, WalkerFamily::kSway, 2);
  INFO(two);
  CHECK(two.contains("(march_2, sway_2 differ from the others): are these several people?"));
  CHECK_FALSE(two.contains("nearer"));
}

TEST_CASE("two takes of one style give no difference to learn", "[style][check]") {
  auto again = motion::make_walker({.family = WalkerFamily::kMarch, .person = 1, .seconds = 7.0});
  CHECK(has_problem(report_of({lesson(walker_file(WalkerFamily::kMarch, 1), "from"),
                               lesson(std::move(*again), "to")}),
                    "no difference to learn"));
}

TEST_CASE("a clip whose legs stand still is not a walk; for another motion name that is a warning",
          "[style][check]") {
  auto standing = walker_file(WalkerFamily::kSway, 2);
  for (std::size_t c = 0; c < standing.skeleton->channels.size(); ++c) {
    const auto& name = standing.skeleton->joints[standing.skeleton->channels[c].joint].name;
    const auto column = static_cast<Eigen::Index>(c);
    if (!name.contains("Leg") && !name.contains("Hips")) continue;
    standing.channels.col(column).setConstant(standing.channels(0, column));
  }
  const auto march = walker_file(WalkerFamily::kMarch, 1);
  CHECK(has_problem(report_of({lesson(march, "from"), lesson(standing, "to")}),
                    "sway_2 is no walk: the legs swing by"));
  const json other = report_of({lesson(march, "from", "wave"), lesson(standing, "to", "wave")});
  CHECK(other["warnings"].dump().contains("sway_2: the legs swing by"));
}

TEST_CASE("gaits are walks and runs of all kinds", "[style][check]") {
  for (const char* gait : {"walk", "run", "walk-turn-left", "jog"}) CHECK(style::is_gait(gait));
  for (const char* other : {"wave", "jump", "crosswalk", ""}) CHECK_FALSE(style::is_gait(other));
}

TEST_CASE("a misspelt gait is pointed out", "[style][check]") {
  const auto warnings_of = [](const std::string& motion) {
    return report_of({lesson(walker_file(WalkerFamily::kMarch, 1), "from", motion),
                      lesson(walker_file(WalkerFamily::kSway, 2), "to", motion)})["warnings"]
        .dump();
  };
  CHECK(warnings_of("wlak").contains("motion 'wlak' is taken for no gait"));
  CHECK(warnings_of("wlak").contains("name it 'walk'"));
  CHECK_FALSE(warnings_of("walk").contains("gait"));
  CHECK_FALSE(warnings_of("dance").contains("gait"));
}

TEST_CASE("a walker with another posture is far from the training", "[style][check]") {
  const auto model = trained({lesson(walker_file(WalkerFamily::kMarch, 1), "from"),
                              lesson(walker_file(WalkerFamily::kSway, 1), "to")})
                         .value();
  const auto own = style::fit_of_walker(model, "m", walker_file(WalkerFamily::kMarch, 1)).value();
  CHECK_FALSE(own.is_far());
  auto bent = walker_file(WalkerFamily::kMarch, 1);
  bent.channels.rightCols(bent.channels.cols() - 6).array() += 0.4;
  const auto far = style::fit_of_walker(model, "m", bent).value();
  CHECK(far.is_far());
  CHECK(far.distance_deg > own.distance_deg);
}

TEST_CASE("styles of real walks and runs pass, useless ones do not", "[style][check][real]") {
  if (!test::shared("data/styles/dataset-2_walk_masculine_001.bvh")) SKIP_WITHOUT_SHARED();
  const json good = real_report("2_walk_masculine_001", "2_walk_feminine_001", "walk");
  CHECK(good["usable"] == true);
  CHECK(good["closes"].get<double>() == Approx(0.88).margin(0.02));
  CHECK(good["constant_closes"].get<double>() == Approx(0.64).margin(0.02));
  CHECK(real_report("2_walk_normal_001", "2_walk_exhausted_001", "walk")["usable"] == true);
  CHECK(real_report("2_run_masculine_001", "2_run_feminine_001", "run")["usable"] == true);
  CHECK(real_report("1_walk_normal_001", "1_walk_feminine_001", "walk")["usable"] == true);

  CHECK(has_problem(real_report("2_walk_normal_001", "2_walk_normal_002", "walk"),
                    "no difference to learn"));
  CHECK(has_problem(real_report("2_walk_normal_001", "2_walk_normal_013", "walk"),
                    "no difference to learn"));
  CHECK(has_problem(
      real_report("2_wave-right-hand_normal_001", "2_raise-up-left-hand_normal_001", "walk"),
      "is no walk"));
}

TEST_CASE("real walks and runs show strides, a jump shows none", "[style][check][real]") {
  if (!test::shared("data/cmu/02_04.bvh")) SKIP_WITHOUT_SHARED();
  const auto cmu = [](const std::string& name) {
    return clip::read_clip(*test::shared("data/cmu/" + name + ".bvh")).value();
  };
  CHECK(has_problem(report_of({lesson(cmu("02_04"), "from"), lesson(cmu("07_01"), "to")}),
                    "02_04.bvh is no walk"));
  for (const auto* name : {"02_03", "09_01"}) {
    const json report = report_of({lesson(cmu(name), "from"), lesson(cmu("07_01"), "to")});
    CHECK(report["clips"][0]["stride_score"] < 0.2);
  }
}

TEST_CASE("a real walk whose pace swings by a quarter within three strides can be learnt from",
          "[style][check][real]") {
  if (!test::shared("data/styles/dataset-2_walk_masculine_001.bvh")) SKIP_WITHOUT_SHARED();
  const auto even = real("2_walk_masculine_002");
  auto uneven = even;  // the same walk, a quarter faster and slower in turns of 4 s
  double at = 0.0;
  for (Eigen::Index t = 0; t < uneven.channels.rows(); ++t) {
    const auto frame = static_cast<Eigen::Index>(at);
    if (frame + 1 >= even.channels.rows()) {
      uneven.channels.conservativeResize(t, Eigen::NoChange);
      break;
    }
    uneven.channels.row(t) = even.channels.row(frame);
    at += 1.0 + 0.25 * std::sin(static_cast<double>(t) * 6.28 / 120.0);
  }
  uneven.path = "uneven.bvh";
  const json report =
      report_of({lesson(uneven, "from"), lesson(real("2_walk_feminine_001"), "to")});
  const json& clip = report["clips"][0];
  CHECK(clip["stride_score"] < 0.2);
  CHECK(clip["residual_deg"] <= 4.2);  // of the even walk: 3.0
  CHECK(report["usable"] == true);
}

TEST_CASE("a real walker of the training is near, another actor far", "[style][check][real]") {
  if (!test::shared("data/styles/dataset-2_walk_masculine_001.bvh")) SKIP_WITHOUT_SHARED();
  const auto model = trained({lesson(real("2_walk_masculine_001"), "from"),
                              lesson(real("2_walk_feminine_001"), "to")})
                         .value();
  const auto is_far = [&](const std::string& name) {
    return style::fit_of_walker(model, "m", real(name)).value().is_far();
  };
  CHECK_FALSE(is_far("2_walk_masculine_002"));
  CHECK_FALSE(is_far("2_walk_feminine_002"));
  CHECK(is_far("1_walk_normal_001"));
  CHECK(is_far("2_run_masculine_001"));
}
