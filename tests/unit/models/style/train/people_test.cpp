// Who shows what: differences are taken within people, a person who shows one style adds walks to
// start from, and what nobody shows is said.
#include <catch2/catch.hpp>

#include <algorithm>

#include <nlohmann/json.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/train/train.hpp"
#include "models/style/train/training_pairs.hpp"
#include "tests/support/backward_tasks.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using motion::WalkerFamily;
using nlohmann::json;

namespace {

style::TrainingClip walk_of(std::uint32_t person, WalkerFamily family, double seconds = 6.0) {
  auto clip = motion::make_walker({.family = family, .person = person, .seconds = seconds}).value();
  clip.path = "walk_" + std::to_string(person);
  return {std::move(clip), family == WalkerFamily::kMarch ? "march" : "sway",
          std::to_string(person), "walk"};
}

style::Dataset dataset_of(const std::vector<style::TrainingClip>& clips) {
  auto dataset = style::make_dataset(clips, {"sway"}, {}).value();
  REQUIRE(style::align(dataset, {}));
  return dataset;
}

style::Difference only_difference(const style::Dataset& dataset) {
  const auto found = style::differences_of(dataset, style::clip_cycles(dataset), "sway");
  REQUIRE(found.size() == 1);
  return found.front();
}

Result<style::StyleModel> model_of(const std::vector<style::TrainingClip>& clips,
                                   TaskRunner* tasks = nullptr) {
  style::TrainOptions options;
  options.target = "sway";
  options.dataset.tasks = tasks;
  return style::train_style(clips, options);
}

clip::Clip recorded(const std::string& name) {
  return clip::read_clip(*test::shared("data/styles/dataset-" + name + ".bvh")).value();
}

double unseen_cycle(const std::vector<style::TrainingClip>& clips) {
  style::TrainOptions options;
  options.target = "feminine";
  const auto model = style::train_style(clips, options).value();
  const auto source = recorded("2_walk_normal_004");
  const auto styled = style::apply_to_clip(model, "m", source, {}).value();
  return style::evaluate_style(source, styled.clip, recorded("2_walk_feminine_004"))
      .value()
      .cycle_ratio;
}

}  // namespace

TEST_CASE("who shows one style only does not move the difference, but adds inputs", "[people]") {
  const std::vector<style::TrainingClip> both{walk_of(1, WalkerFamily::kMarch),
                                              walk_of(1, WalkerFamily::kSway)};
  auto more = both;
  more.push_back(walk_of(2, WalkerFamily::kMarch));
  more.push_back(walk_of(3, WalkerFamily::kSway));
  const style::Dataset dataset = dataset_of(more);
  const auto pairs = style::make_training_pairs(dataset, style::clip_cycles(dataset), "sway");
  CHECK(pairs.inputs.size() == 4);
  CHECK(pairs.outputs.of_input == std::vector{0, style::kNoDifference, 0, style::kNoDifference});
  const auto difference = only_difference(dataset);
  CHECK(difference.people == 1);
  const auto takes = style::clip_cycles(dataset);
  CHECK(difference.delta.isApprox(takes[1].coefficients - takes[0].coefficients));
}

TEST_CASE("people count alike, whatever the number of their takes", "[people]") {
  const auto dataset =
      dataset_of({walk_of(1, WalkerFamily::kMarch), walk_of(1, WalkerFamily::kMarch, 7.0),
                  walk_of(1, WalkerFamily::kSway), walk_of(2, WalkerFamily::kMarch),
                  walk_of(2, WalkerFamily::kSway)});
  const auto takes = style::clip_cycles(dataset);
  const auto cycle = [&](std::size_t i) { return takes[i].coefficients; };
  const Eigen::MatrixXd first = cycle(2) - 0.5 * (cycle(0) + cycle(1));
  const Eigen::MatrixXd second = cycle(4) - cycle(3);
  const auto difference = only_difference(dataset);
  CHECK(difference.people == 2);
  CHECK(difference.delta.isApprox(0.5 * (first + second)));
}

TEST_CASE("where nobody shows both styles the groups are compared, and a warning says so",
          "[people]") {
  const std::vector<style::TrainingClip> clips{walk_of(1, WalkerFamily::kMarch),
                                               walk_of(2, WalkerFamily::kSway)};
  CHECK(only_difference(dataset_of(clips)).people == 0);
  const auto report = json::parse(model_of(clips).value().report_json);
  CHECK(report["warnings"].dump().contains("nobody shows both 'march' and 'sway' in motion walk"));
}

TEST_CASE("the model is the same bits whatever runs the tasks, in whatever order", "[people]") {
  std::vector<style::TrainingClip> clips;
  for (const std::uint32_t person : {1U, 2U, 3U}) {
    clips.push_back(walk_of(person, WalkerFamily::kMarch));
    clips.push_back(walk_of(person, WalkerFamily::kSway));
  }
  test::BackwardTasks backward;
  CHECK(style::serialize_model(model_of(clips).value()) ==
        style::serialize_model(model_of(clips, &backward).value()));
}

TEST_CASE("a second person's normal walk does not change what is learnt from the first",
          "[people][real]") {
  if (!test::shared("data/styles/dataset-2_walk_normal_001.bvh")) SKIP_WITHOUT_SHARED();
  std::vector<style::TrainingClip> clips;
  for (const char* take : {"001", "002"}) {
    for (const char* group : {"normal", "feminine"}) {
      clips.push_back(
          {recorded(std::string("2_walk_") + group + "_" + take), group, "ann", "walk"});
    }
  }
  const double alone = unseen_cycle(clips);
  clips.insert(clips.begin(), {recorded("1_walk_normal_001"), "normal", "bob", "walk"});
  CHECK(std::abs(unseen_cycle(clips) - alone) <= 0.01);
}

TEST_CASE("takes of two days are told apart by the walker's own walk", "[people][real]") {
  if (!test::shared("data/styles/dataset-2_walk_normal_013.bvh")) SKIP_WITHOUT_SHARED();
  std::vector<style::TrainingClip> clips;
  for (const char* group : {"normal", "feminine"}) {
    for (const char* take : {"001", "002", "004", "005", "006", "013"}) {
      clips.push_back(
          {recorded(std::string("2_walk_") + group + "_" + take), group, "ann", "walk"});
    }
  }
  style::TrainOptions options;
  options.target = "feminine";
  const auto model = style::train_style(clips, options).value();
  CHECK(json::parse(model.report_json)["follows_days"] == true);
  const auto source = recorded("2_walk_normal_014");
  const auto styled = style::apply_to_clip(model, "m", source, {}).value();
  CHECK(style::evaluate_style(source, styled.clip, recorded("2_walk_feminine_014"))
            .value()
            .cycle_ratio <= 0.2);  // with one mean 0.246
}
