// Alpha is held where arms would run into the body, on a walker whose style is a bent elbow.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/live/bound_model.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/train/train.hpp"
#include "tests/support/last_frame.hpp"

namespace posed {
namespace {

clip::Clip walker_of(std::uint32_t person) {
  return motion::make_walker({.family = motion::WalkerFamily::kWalk, .person = person}).value();
}

// The upper arms are twisted inwards, and the elbows bent.
clip::Clip with_arms(clip::Clip clip, double twist_rad, double elbow_rad) {
  const Skeleton& skeleton = *clip.skeleton;
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    const auto bone = skeleton.joints[static_cast<std::size_t>(channel.joint)].bone;
    if (channel.translation || !bone) continue;
    const bool upper = *bone == Bone::kLeftUpperArm || *bone == Bone::kRightUpperArm;
    double turn_rad = upper && channel.axis == Axis::kX ? twist_rad : 0.0;
    if (*bone == Bone::kLeftLowerArm && channel.axis == Axis::kY) turn_rad = -elbow_rad;
    if (*bone == Bone::kRightLowerArm && channel.axis == Axis::kY) turn_rad = elbow_rad;
    clip.channels.col(static_cast<Eigen::Index>(c)).array() += turn_rad;
  }
  return clip;
}

style::StyleModel taught(double twist_rad, double elbow_rad) {
  std::vector<style::TrainingClip> clips;
  for (const std::uint32_t person : {1U, 2U}) {
    const std::string who = "walker" + std::to_string(person);
    clips.push_back({walker_of(person), "from", who, "walk", ""});
    clips.push_back({with_arms(walker_of(person), twist_rad, elbow_rad), "to", who, "walk", ""});
  }
  style::TrainOptions options;
  options.target = "to";
  return style::train_style(clips, options).value();
}

}  // namespace

TEST_CASE("alpha stops before the arms are in the body, and says so once", "[style]") {
  const style::StyleModel model = taught(0.8, 0.7);
  const clip::Clip clip = walker_of(3);
  const auto bound = style::bind_model(model, *clip.skeleton, "arms.style").value();
  REQUIRE(bound->reach.size() == 1);
  const style::AlphaReach reach = bound->reach.front();
  INFO(reach.low << " to " << reach.high);
  CHECK(reach.high >= 1.0);
  CHECK(reach.high < style::kMaxAlpha);
  for (const double end : {reach.low, reach.high}) CHECK(end == std::round(10.0 * end) / 10.0);

  const auto styled = [&](double alpha) {
    style::ApplyOptions options;
    options.filter.alpha = alpha;
    return style::apply_to_clip(model, "arms.style", clip, options).value();
  };
  const style::Applied most = styled(2.0);
  CHECK(most.alpha == reach.high);
  CHECK(most.clip.channels == styled(reach.high).clip.channels);
  CHECK(styled(0.5).alpha == 0.5);

  style::StyleFilter filter(bound.get(), {.alpha = 2.0});
  test::LastFrame out;
  std::size_t told = 0;
  for (int i = 0; i < 20; ++i) {
    const Frame in = clip.frame(i);
    filter.process({.frame = in, .input = &in}, out);
    while (const auto notice = filter.take_notice()) {
      told += notice->index == style::StyleFilter::kAlphaHeld ? 1 : 0;
    }
  }
  CHECK(told == 1);
}

TEST_CASE("a style that leaves the arms alone may be doubled", "[style]") {
  const clip::Clip clip = walker_of(3);
  const auto bound = style::bind_model(taught(0.0, 0.2), *clip.skeleton, "mild.style").value();
  CHECK(bound->reach.front().high == Approx(style::kMaxAlpha));
}

}  // namespace posed
