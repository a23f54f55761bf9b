// The style model's figures on real recordings: acted walks and runs at 30 Hz, trained on takes 001
// and evaluated on takes 002.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "models/motion/motion.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/support/shared.hpp"

using namespace posed;

namespace {

std::optional<std::filesystem::path> recording(const std::string& name) {
  return test::shared("data/styles/dataset-2_" + name + ".bvh");
}

bool styles_recorded() { return recording("walk_masculine_001").has_value(); }

clip::Clip take(const std::string& name) {
  const auto path = recording(name);
  INFO(name);
  REQUIRE(path);
  auto clip = clip::read_clip(*path);
  REQUIRE(clip);
  return *std::move(clip);
}

struct Lesson {
  std::string motion, group;
};

// A model trained on takes 001 of the lessons, with the target feminine.
style::StyleModel train_on_takes(const std::vector<Lesson>& lessons) {
  std::vector<style::TrainingClip> clips;
  for (const Lesson& lesson : lessons) {
    const std::string name = lesson.motion + "_" + lesson.group + "_001";
    clips.push_back({take(name), lesson.group, name, lesson.motion});
  }
  style::TrainOptions options;
  options.target = "feminine";
  auto model = style::train_style(clips, options);
  REQUIRE(model);
  return *std::move(model);
}

style::StyleModel trained_walk() {
  return train_on_takes({{"walk", "masculine"}, {"walk", "feminine"}});
}

style::StyleScore score(const style::StyleModel& model, const clip::Clip& source,
                        const clip::Clip& target) {
  const auto styled = style::apply_to_clip(model, "taught.style", source, {});
  REQUIRE(styled);
  const auto result = style::evaluate_style(source, styled->clip, target);
  REQUIRE(result);
  return *result;
}

// The same walk at another rate: slerp between frames, written back into the clip's channels.
clip::Clip upsampled(const clip::Clip& clip, double rate_hz) {
  const auto motion = motion::resample(motion::motion_of(clip).value(), rate_hz);
  const double step = clip.frame_rate_hz / rate_hz;
  const Skeleton& skeleton = *clip.skeleton;
  clip::Clip out = clip;
  out.frame_rate_hz = rate_hz;
  out.channels.resize(motion.size(), clip.channels.cols());
  for (int t = 0; t < motion.size(); ++t) {
    const int low = std::min(static_cast<int>(t * step), clip.frames() - 1);
    const int high = std::min(low + 1, clip.frames() - 1);
    out.channels.row(t) = clip.channels.row(low) +
                          (t * step - low) * (clip.channels.row(high) - clip.channels.row(low));
    for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
      std::vector<Eigen::Index> columns;
      std::array<double, 3> near_rad{};
      for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
        if (skeleton.channels[c].joint != j || skeleton.channels[c].translation) continue;
        near_rad[columns.size()] = clip.channels(low, static_cast<Eigen::Index>(c));
        columns.push_back(static_cast<Eigen::Index>(c));
      }
      const auto rotation =
          to_eigen_double(motion.frames[t].rotation_xyzw[static_cast<std::size_t>(j)]);
      const auto angles = channels_from_rotation(skeleton, j, rotation, near_rad);
      for (std::size_t i = 0; i < columns.size(); ++i) out.channels(t, columns[i]) = angles[i];
    }
  }
  return out;
}

}  // namespace

TEST_CASE("a walk trained on one take each comes near the style's held-out take", "[style][real]") {
  if (!styles_recorded()) SKIP_WITHOUT_SHARED();
  const auto result = score(trained_walk(), take("walk_masculine_002"), take("walk_feminine_002"));
  CHECK(result.cycle_ratio <= 0.15);
  CHECK(result.jerk_ratio >= 0.90);
  CHECK(result.jerk_ratio <= 1.10);
}

TEST_CASE("walk and run in one model: the run is styled, the walk is not hurt", "[style][real]") {
  if (!styles_recorded()) SKIP_WITHOUT_SHARED();
  const auto both = train_on_takes(
      {{"walk", "masculine"}, {"walk", "feminine"}, {"run", "masculine"}, {"run", "feminine"}});
  const auto run = score(both, take("run_masculine_002"), take("run_feminine_002"));
  CHECK(run.cycle_ratio <= 0.24);
  const auto source = take("walk_masculine_002");
  const auto target = take("walk_feminine_002");
  const auto alone = score(trained_walk(), source, target);
  CHECK(score(both, source, target).cycle_ratio <= alone.cycle_ratio + 0.005);
}

TEST_CASE(
    "a normal walk among the sources is styled; a walk already in the style is hardly changed",
    "[style][real]") {
  if (!styles_recorded()) SKIP_WITHOUT_SHARED();
  const auto model =
      train_on_takes({{"walk", "masculine"}, {"walk", "normal"}, {"walk", "feminine"}});
  const auto target = take("walk_feminine_002");
  const auto normal = score(model, take("walk_normal_002"), target);
  CHECK(normal.cycle_ratio <= 0.21);
  const auto already = score(model, target, take("walk_feminine_001"));
  CHECK(already.component_rms_deg <= 2.0);
  CHECK(score(trained_walk(), target, take("walk_feminine_001")).component_rms_deg <= 2.0);
}

TEST_CASE("a model trained at 30 Hz works on the same walk at 120 Hz, frame by frame",
          "[style][real]") {
  if (!styles_recorded()) SKIP_WITHOUT_SHARED();
  const auto model = trained_walk();
  const auto walk = take("walk_masculine_002");
  const auto target = take("walk_feminine_002");
  REQUIRE(walk.frame_rate_hz == Approx(30.0).epsilon(1e-3));
  const auto fast = upsampled(walk, 120.0);
  REQUIRE(fast.frames() == 4 * (walk.frames() - 1) + 1);
  CHECK(score(model, fast, target).cycle_ratio ==
        Approx(score(model, walk, target).cycle_ratio).margin(0.01));

  const auto bound = style::bind_model(model, *fast.skeleton, "taught").value();
  style::StyleFilter filter(bound.get(), {});
  test::LastFrame last;
  for (int t = 0; t < fast.frames(); ++t) {
    Frame in = fast.frame(t);
    in.header.sequence = 7U + 3U * static_cast<std::uint64_t>(t);
    in.header.arrival_ns = in.header.device_ns + 1'234'567;
    filter.process({.frame = in}, last);
    REQUIRE(last.count == t + 1);
    REQUIRE(last.out.header.sequence == in.header.sequence);
    REQUIRE(last.out.header.device_ns == in.header.device_ns);
    REQUIRE(last.out.header.arrival_ns == in.header.arrival_ns);
  }
}
