// The drawn thumbnail of a style shows people who stand on the ground and stride.
#include "models/style/model/model_strip.hpp"

#include <algorithm>
#include <memory>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/train/train.hpp"

namespace posed::style {
namespace {

TrainingClip take(motion::WalkerFamily family, const char* group) {
  return {.clip = motion::make_walker({.family = family, .seconds = 8.0}).value(),
          .group = group,
          .subject = "ann",
          .motion = "walk"};
}

}  // namespace

TEST_CASE("the thumbnail of a style has six people who stride to the right", "[strip]") {
  TrainOptions options;
  options.target = "sway";
  options.dataset.space = motion::Space::kHumanoid;
  auto model = train_style({take(motion::WalkerFamily::kMarch, "march"),
                            take(motion::WalkerFamily::kSway, "sway")},
                           options)
                   .value();
  const std::string strip = strip_of(model);
  INFO(strip);
  CHECK(std::regex_match(strip, std::regex("(M-?[0-9]+ -?[0-9]+(L-?[0-9]+ -?[0-9]+)+)+")));
  CHECK(std::ranges::count(strip, 'M') == 5 * kStripPoses);
  CHECK(strip.size() < 2000);
  const std::regex place("(-?[0-9]+) (-?[0-9]+)");
  int lowest = 0, highest = kStripHeight_cm, left = 0, right = 0;
  for (std::sregex_iterator at(strip.begin(), strip.end(), place), end; at != end; ++at) {
    const int x = std::stoi((*at)[1]), y = std::stoi((*at)[2]);
    lowest = std::max(lowest, y), highest = std::min(highest, y);
    left = std::min(left, x), right = std::max(right, x);
  }
  CHECK(lowest > 165);
  CHECK(lowest <= kStripHeight_cm);
  CHECK(highest >= 0);
  CHECK(highest < 60);
  CHECK(left >= 0);
  CHECK(right <= kStripPoses * kStripPose_cm);

  model.gate.usual.front().resize(3, 2);
  CHECK(strip_of(model).empty());
  model.gate.usual.clear();
  CHECK(strip_of(model).empty());
}

TEST_CASE("a style of a skeleton's own joints is drawn on whom it was trained on", "[strip]") {
  const auto walkers = [](bool others) {
    std::vector<TrainingClip> takes{take(motion::WalkerFamily::kMarch, "march"),
                                    take(motion::WalkerFamily::kSway, "sway")};
    for (auto& one : takes) {
      auto own = std::make_shared<Skeleton>(*one.clip.skeleton);
      if (others) own->joints.back().name = "another";
      one.clip.skeleton = std::move(own);
    }
    return takes;
  };
  TrainOptions options;
  options.target = "sway";
  options.dataset.space = motion::Space::kNative;
  const auto of_demo = train_style(walkers(false), options).value();
  CHECK(std::ranges::count(strip_of(of_demo), 'M') == 5 * kStripPoses);
  const auto own = walkers(true);
  const auto of_another = train_style(own, options).value();
  CHECK(strip_of(of_another).empty());
  const std::vector known{own.front().clip.skeleton};
  CHECK(std::ranges::count(strip_of(of_another, known), 'M') == 5 * kStripPoses);
}

}  // namespace posed::style
