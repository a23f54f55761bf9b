// Gate, warm-up and auto-alpha on real recordings: known and unknown walkers, and what is no walk.
#include <catch2/catch.hpp>

#include <optional>
#include <string>
#include <vector>

#include "models/motion/motion.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/live/bound_model.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/shared.hpp"

using namespace posed;

namespace {

clip::Clip recording_of(const std::string& name) {
  const auto path = test::shared("data/" + name);
  INFO(name);
  REQUIRE(path);
  return clip::read_clip(*path).value();
}

clip::Clip acted(const std::string& name) {
  return recording_of("styles/dataset-2_" + name + ".bvh");
}

bool gate_recordings() {
  return test::shared("data/styles/dataset-2_walk_normal_001.bvh").has_value();
}

style::StyleModel taught(const std::string& source) {
  std::vector<style::TrainingClip> clips;
  for (const std::string& group : {source, std::string("feminine")}) {
    for (const char* number : {"001", "002"}) {
      clips.push_back({acted("walk_" + group + "_" + number), group, "actor", "walk"});
    }
  }
  style::TrainOptions options;
  options.target = "feminine";
  options.dataset.space = motion::Space::kHumanoid;
  return style::train_style(clips, options).value();
}

style::Applied applied(const style::StyleModel& model, const clip::Clip& clip,
                       const style::ApplyOptions& options = {}) {
  auto result = style::apply_to_clip(model, "taught.style", clip, options);
  REQUIRE(result);
  return *std::move(result);
}

// A clip as long as this one, of its first pose.
clip::Clip held(clip::Clip clip) {
  clip.channels.rowwise() = Eigen::RowVectorXd(clip.channels.row(0));
  return clip;
}

// The same with all joints at rest; in these files that is a T-pose.
clip::Clip t_pose(clip::Clip clip) {
  clip = held(std::move(clip));
  clip.channels.rightCols(clip.channels.cols() - 3).setZero();
  return clip;
}

double gate_mean(const style::StyleModel& model, const clip::Clip& clip,
                 const std::optional<style::Walker>& walker = {}, bool cold = false) {
  style::ApplyOptions options;
  options.cold = cold;
  options.walker = walker;
  return applied(model, clip, options).gate_mean.value();
}

clip::Clip part(clip::Clip clip, int first, int frames) {
  clip.channels = Eigen::MatrixXd(clip.channels.middleRows(first, frames));
  return clip;
}

class NoOut final : public StageOut {
 public:
  void frame(const StageFrame& /*frame*/) noexcept override {}
};

// Live, the second clip after the first: from its first frame on until the gate is so.
template <typename Condition>
double seconds_until(const style::StyleModel& model, const clip::Clip& before,
                     const clip::Clip& after, Condition is_so) {
  clip::Clip both = before;
  both.channels.resize(before.frames() + after.frames(), Eigen::NoChange);
  both.channels << before.channels, after.channels;
  const auto bound = style::bind_model(model, *both.skeleton, "taught.style").value();
  style::StyleFilter filter(bound.get(), {});
  NoOut out;
  int waited = 0;
  for (int i = 0; i < both.frames() && (waited == 0 || !is_so(filter.gate())); ++i) {
    if (i == before.frames()) REQUIRE_FALSE(is_so(filter.gate()));
    if (i >= before.frames()) ++waited;
    const Frame in = both.frame(i);
    filter.process({.frame = in, .input = &in}, out);
  }
  return waited / both.frame_rate_hz;
}

}  // namespace

TEST_CASE("the gate knows known and unknown walkers and nothing else", "[style][real]") {
  if (!gate_recordings()) SKIP_WITHOUT_SHARED();
  const auto model = taught("normal");
  CHECK(gate_mean(model, acted("walk_normal_004")) > 0.98);
  CHECK(gate_mean(model, acted("walk_feminine_004")) > 0.98);
  for (const char* name : {"cmu/02_02.amc", "cmu/07_01.amc", "cmu/08_01.amc", "cmu/16_15.amc",
                           "cmu/35_01.amc", "cmu/39_01.amc"}) {
    INFO(name);
    const clip::Clip walk = recording_of(name);
    const auto walker = style::measure_walker(model, "taught.style", walk);
    REQUIRE(walker);
    CHECK(gate_mean(model, walk, {}, true) >= 0.8);
    CHECK(gate_mean(model, walk, *walker) >= 0.9);
  }
  const auto actor = style::measure_walker(model, "taught.style", acted("walk_normal_001"));
  REQUIRE(actor);
  for (const char* name : {"run_masculine_001", "run_active_001", "run_exhausted_001",
                           "run_elderly_001", "run_feminine_001", "run_youthful_001"}) {
    INFO(name);
    CHECK(gate_mean(model, acted(name), {}, true) <= 0.2);
  }
  // Its cadence is that of an active walk, and its pelvis leads the legs: only its fall tells it.
  CHECK(gate_mean(taught("active"), acted("run_exhausted_002")) <= 0.1);
  for (const char* name : {"walk_elderly_004", "walk_exhausted_001", "walk_masculine_001",
                           "walk_youthful_001", "walk_active_001"}) {
    INFO(name);
    CHECK(gate_mean(model, acted(name), {}, true) >= 0.85);
  }
  for (const char* name : {"run_normal_001", "raise-up-left-hand_normal_001",
                           "wave-left-hand_normal_001", "wave-right-hand_feminine_001"}) {
    INFO(name);
    CHECK(gate_mean(model, acted(name), {}, true) <= 0.2);
    CHECK(gate_mean(model, acted(name), *actor) <= 0.1);
  }
  for (const clip::Clip& still :
       {held(acted("raise-up-left-hand_normal_001")), held(acted("walk_normal_004")),
        t_pose(acted("walk_normal_004"))}) {
    CHECK(gate_mean(model, still, {}, true) <= 0.2);
    CHECK(gate_mean(model, still, *actor) <= 0.1);
  }
  CHECK(gate_mean(model, recording_of("cmu/02_04.bvh"), {}, true) <= 0.2);
  CHECK(gate_mean(model, recording_of("cmu/09_01.bvh"), {}, true) <= 0.2);
}

TEST_CASE("a run that becomes a walk and a walk that freezes are known within 0.3 s",
          "[style][real]") {
  if (!gate_recordings()) SKIP_WITHOUT_SHARED();
  const auto model = taught("normal");
  for (const char* style : {"normal", "feminine"}) {
    INFO(style);
    const clip::Clip run = acted(std::string("run_") + style + "_001");
    clip::Clip walk = acted(std::string("walk_") + style + "_004");
    walk = part(walk, 60, 100);
    CHECK(seconds_until(model, run, walk, [](double gate) { return gate >= 0.5; }) <= 0.3);
    for (int frame = 30; frame < 66; frame += 4) {
      const clip::Clip frozen = held(part(walk, frame, 30));
      CHECK(seconds_until(model, part(walk, 0, frame), frozen,
                          [](double gate) { return gate <= 0.5; }) <= 0.3);
    }
  }
}

TEST_CASE("a clip that shows no walk measures no walker", "[style][real]") {
  if (!gate_recordings()) SKIP_WITHOUT_SHARED();
  const auto model = taught("normal");
  const auto stood =
      style::measure_walker(model, "taught.style", acted("wave-left-hand_normal_001"));
  REQUIRE_FALSE(stood);
  CHECK(stood.error().message.contains("shows no walk"));
}

TEST_CASE("auto-alpha leaves a walk in the style alone and styles the source", "[style][real]") {
  if (!gate_recordings()) SKIP_WITHOUT_SHARED();
  const auto model = taught("masculine");
  style::ApplyOptions options;
  const auto full = applied(model, acted("walk_masculine_004"));
  options.filter.auto_alpha = true;
  const auto source = applied(model, acted("walk_masculine_004"), options);
  CHECK(source.rms_change_rad > 0.9 * full.rms_change_rad);
  const auto already = applied(model, acted("walk_feminine_004"), options);
  CHECK(already.rms_change_rad < 1.0 * kDegree);
  CHECK(already.estimate_mean.value() > 0.9);
  CHECK(source.estimate_mean.value() < 0.1);
}
