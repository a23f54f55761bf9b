// Several targets in one training: each style is the one of its own training, on shared poses.
#include <catch2/catch.hpp>

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/gp/regression.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/train/train.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"

namespace posed::test_several {
namespace {

using motion::WalkerFamily;
using nlohmann::json;
using style::StyleModel;
using style::TrainingClip;

// Walks of two people: a march, a sway, and a sway at half the size under another name.
std::vector<TrainingClip> walks() {
  std::vector<TrainingClip> clips;
  for (std::uint32_t person = 1; person <= 2; ++person) {
    for (const auto family : {WalkerFamily::kMarch, WalkerFamily::kSway}) {
      auto clip = motion::make_walker({.family = family, .person = person, .seconds = 6.0}).value();
      clip.path = "walk_" + std::to_string(person);
      clips.push_back({std::move(clip), family == WalkerFamily::kMarch ? "march" : "sway",
                       std::to_string(person), "walk"});
    }
    const clip::Clip& march = clips[clips.size() - 2].clip;
    TrainingClip half = clips.back();
    half.group = "half";
    const auto rows = std::min(half.clip.channels.rows(), march.channels.rows());
    half.clip.channels.conservativeResize(rows, Eigen::NoChange);
    half.clip.channels.col(12) += Eigen::VectorXd::Constant(rows, 0.3);
    half.clip.channels.col(15) -= Eigen::VectorXd::Constant(rows, 0.3);
    clips.push_back(std::move(half));
  }
  return clips;
}

std::vector<TrainingClip> only(const std::vector<TrainingClip>& clips,
                               const std::vector<std::string>& groups) {
  std::vector<TrainingClip> kept;
  for (const TrainingClip& clip : clips) {
    if (std::ranges::find(groups, clip.group) != groups.end()) kept.push_back(clip);
  }
  return kept;
}

Result<StyleModel> trained(const std::vector<TrainingClip>& clips,
                           const std::vector<std::string>& targets) {
  style::TrainOptions options;
  options.target = targets.front();
  options.more_targets.assign(targets.begin() + 1, targets.end());
  return style::train_style(clips, options);
}

StyleModel corner(const StyleModel& model, std::size_t style) {
  std::vector<double> shares(model.styles(), 0.0);
  shares[style] = 1.0;
  return style::mixture_of(model, shares);
}

}  // namespace

TEST_CASE("the gate of several styles does not depend on their order", "[style]") {
  const auto clips = walks();
  const StyleModel one = trained(clips, {"sway", "half"}).value();
  const StyleModel other = trained(clips, {"half", "sway"}).value();
  CHECK(one.gate.neutral.isApprox(other.gate.neutral));
  CHECK(one.gate.swing_rad == other.gate.swing_rad);
  CHECK(one.gate.fastest_stride_s == other.gate.fastest_stride_s);
  CHECK(one.gate.swing_rad > 0.0);
}

TEST_CASE("each of several styles is the one of its own training", "[style]") {
  const auto clips = walks();
  const std::vector<std::string> targets{"sway", "half"};
  const StyleModel both = trained(clips, targets).value();
  CHECK(both.names() == targets);
  CHECK(both.from == "march");
  for (std::size_t s = 0; s < targets.size(); ++s) {
    INFO(targets[s]);
    const StyleModel alone = trained(only(clips, {"march", targets[s]}), {targets[s]}).value();
    CHECK(both.process.inputs.rows() <= alone.process.inputs.rows());
    CHECK(alone.more.empty());
    const Eigen::MatrixXd& at = alone.process.inputs;
    const Eigen::MatrixXd own = gp::posterior_mean(alone.process, at);
    const Eigen::MatrixXd mixed = gp::posterior_mean(corner(both, s).process, at);
    CHECK((mixed - own).norm() < 0.05 * own.norm());
    const Eigen::VectorXd limit = s == 0 ? both.limit_rad : both.more[s - 1].limit_rad;
    CHECK(limit.isApprox(alone.limit_rad));
  }
}

TEST_CASE("the report of several styles names each, and is usable where all are", "[style]") {
  const auto clips = walks();
  const json good = json::parse(trained(clips, {"sway", "half"}).value().report_json);
  REQUIRE(good["targets"].size() == 2);
  CHECK(good["targets"][0]["name"] == "sway");
  CHECK(good["targets"][1]["name"] == "half");
  CHECK(good["usable"] == (good["targets"][0]["usable"] && good["targets"][1]["usable"]));
  CHECK(test::has(good["verdict"].get<std::string>(), "sway: "));
  auto same = only(clips, {"march", "sway"});
  for (TrainingClip clip : only(clips, {"march"})) {
    clip.group = "nothing";
    clip.clip.channels.array() += 1e-6;
    same.push_back(std::move(clip));
  }
  const json bad = json::parse(trained(same, {"sway", "nothing"}).value().report_json);
  CHECK_FALSE(bad["usable"].get<bool>());
  CHECK(test::has(bad["verdict"].get<std::string>(), "nothing: unusable"));
}

TEST_CASE("targets that cannot be told apart or learnt are refused with a sentence", "[style]") {
  const auto clips = walks();
  const auto wrong = [&](const std::vector<std::string>& targets) {
    const auto model = trained(clips, targets);
    REQUIRE_FALSE(model);
    return model.error().message;
  };
  CHECK(test::has(wrong({"sway", "sway"}), "named twice"));
  CHECK(test::has(wrong({"sway", "a,b"}), "weights are written"));
  CHECK(test::has(wrong({"sway", "sad"}), "no clip of the target group 'sad'"));
  CHECK(test::has(wrong({"march", "sway", "half"}), "clips of the target group 'march' only"));
  CHECK(test::has(wrong(std::vector<std::string>(17, "x")), "at most 16 targets"));
}

TEST_CASE("four styles in one model are as near the target as four models", "[style][real]") {
  const auto file = [](const std::string& name) {
    return test::shared("data/styles/dataset-2_walk_" + name + ".bvh");
  };
  if (!file("normal_001")) SKIP_WITHOUT_SHARED();
  const auto take = [&](const std::string& name) { return clip::read_clip(*file(name)).value(); };
  const std::vector<std::string> targets{"feminine", "active", "elderly", "exhausted"};
  std::vector<TrainingClip> clips;
  for (const auto* number : {"_001", "_002"}) {
    clips.push_back({take(std::string("normal") + number), "normal", "a", "walk"});
    for (const std::string& target : targets) {
      clips.push_back({take(target + number), target, "a", "walk"});
    }
  }
  const StyleModel all = trained(clips, targets).value();
  const clip::Clip source = take("normal_004");
  for (const std::string& target : targets) {
    const StyleModel alone = trained(only(clips, {"normal", target}), {target}).value();
    const auto cycle = [&](const StyleModel& model) {
      style::ApplyOptions options;
      options.filter.weights = target + "=1";
      const auto styled = style::apply_to_clip(model, "m", source, options).value();
      return style::evaluate_style(source, styled.clip, take(target + "_004")).value().cycle_ratio;
    };
    const double one = cycle(alone);
    const double mixed = cycle(all);
    INFO(target << ": alone " << one << ", in one model " << mixed << ", "
                << all.process.inputs.rows() << " poses");
    CHECK(mixed <= one + 0.01);
  }
}

}  // namespace posed::test_several
