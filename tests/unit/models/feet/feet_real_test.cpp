// Standing feet on real recordings: acted walks at 30 Hz, trained on takes 001, tested on take 004.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/train/train.hpp"
#include "tests/support/shared.hpp"

namespace posed::feet {
namespace {

clip::Clip walk_of(const std::string& name) {
  INFO(name);
  const auto path = test::shared("data/styles/dataset-2_walk_" + name + ".bvh");
  REQUIRE(path);
  return clip::read_clip(*path).value();
}

style::StyleScore score_of(const style::StyleModel& model, const std::string& target,
                           RootMode mode) {
  const clip::Clip source = walk_of("normal_004");
  style::ApplyOptions options;
  options.feet = RootOptions{.mode = mode};
  const auto styled = style::apply_to_clip(model, "walk.style", source, options).value();
  if (mode == RootMode::kActor) CHECK(styled.max_root_offset_m <= 0.10);
  return style::evaluate_style(source, styled.clip, walk_of(target + "_004"), model.space).value();
}

}  // namespace

TEST_CASE("feet of an unseen walk stand in another style", "[feet][real]") {
  if (!test::shared("data/styles/dataset-2_walk_normal_004.bvh")) SKIP_WITHOUT_SHARED();
  struct Wanted {
    std::string style;
    double stride, root_low, root_high;  // times the source's slide, the real style's speed
  };
  // The active style has a faster cadence, which the styled walk does not take over.
  const std::vector<Wanted> wanted{
      {"feminine", 2.0, 0.85, 1.15}, {"active", 3.0, 0.7, 1.0}, {"elderly", 2.0, 0.85, 1.15}};
  for (const Wanted& one : wanted) {
    INFO(one.style);
    std::vector<style::TrainingClip> clips;
    for (const std::string& name : {std::string("normal"), one.style}) {
      clips.push_back({walk_of(name + "_001"), name, name, "walk"});
    }
    style::TrainOptions options;
    options.target = one.style;
    const auto model = style::train_style(clips, options).value();
    const auto off = score_of(model, one.style, RootMode::kOff);
    const double source_m_s = off.slide_m_s.source.value();
    CHECK(off.slide_m_s.styled.value() > 4.0 * source_m_s);
    const auto stride = score_of(model, one.style, RootMode::kStride);
    CHECK(stride.slide_m_s.styled.value() < one.stride * source_m_s);
    CHECK(stride.sink_m.value() < 0.01);
    CHECK(stride.cycle_ratio < off.cycle_ratio + 0.015);
    CHECK(stride.jerk_ratio > 0.9);
    CHECK(stride.jerk_ratio < 1.2);  // active, from one take: 1.17 without feet, too
    const double speed = *stride.root_speed_m_s.styled / *stride.root_speed_m_s.target;
    CHECK(speed > one.root_low);
    CHECK(speed < one.root_high);
    const auto actor = score_of(model, one.style, RootMode::kActor);
    CHECK(actor.slide_m_s.styled.value() < 3.0 * source_m_s);
    CHECK(actor.sink_m.value() < 0.01);
  }
}

}  // namespace posed::feet
