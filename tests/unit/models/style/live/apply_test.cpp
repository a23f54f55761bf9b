// A clip through the style stage: settled start, cold start, and values that must not change.
#include "models/style/live/apply.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/models/style/toy_style.hpp"

using namespace posed;
using namespace posed::test;

namespace {

class Keep final : public StageOut {
 public:
  void frame(const StageFrame& made) noexcept override {
    const Frame& frame = made.frame;
    out = frame;
  }
  Frame out;
};

style::Applied applied(const clip::Clip& clip, double alpha, bool cold = false) {
  style::ApplyOptions options;
  options.filter.alpha = alpha;
  options.cold = cold;
  auto result = style::apply_to_clip(toy_model(1), "toy.style", clip, options);
  REQUIRE(result);
  return *std::move(result);
}

double furthest_rad(const Frame& a, const Frame& b) {
  double furthest = 0.0;
  for (std::size_t j = 0; j < a.joint_count; ++j) {
    furthest = std::max(furthest, angle_between_rad(to_eigen_double(a.rotation_xyzw[j]),
                                                    to_eigen_double(b.rotation_xyzw[j])));
  }
  return furthest;
}

}  // namespace

TEST_CASE("apply --cold gives the live filter's frames", "[style][apply]") {
  const clip::Clip walk = toy_walk(200, 60.0, 1.0);
  const style::Applied cold = applied(walk, 1.0, true);
  const auto ready = style::bind_model(toy_model(1), *walk.skeleton, "toy").value();
  style::StyleFilter live(ready.get(), {});
  Keep keep;
  for (int i = 0; i < walk.frames(); ++i) {
    const Frame in = walk.frame(i);
    live.process({.frame = in}, keep);
    CHECK(furthest_rad(keep.out, cold.clip.frame(i)) < 1e-5);
  }
}

TEST_CASE("a settled start has the full style and the heading from frame one", "[style][apply]") {
  const clip::Clip walk = toy_walk(240, 60.0, 1.0);
  const style::Applied cold = applied(walk, 1.0, true);
  const style::Applied settled = applied(walk, 1.0);
  CHECK(furthest_rad(walk.frame(0), cold.clip.frame(0)) == 0.0);
  CHECK(furthest_rad(walk.frame(0), settled.clip.frame(0)) > 0.1);
  // The walk repeats each second: frame 0 with a settled start equals frame 180 of both.
  CHECK(angle_between_rad(delta_of(walk.frame(0), settled.clip.frame(0), 3),
                          delta_of(walk.frame(180), settled.clip.frame(180), 3)) < 0.01);
  CHECK(angle_between_rad(delta_of(walk.frame(180), cold.clip.frame(180), 3),
                          delta_of(walk.frame(180), settled.clip.frame(180), 3)) < 0.01);
}

TEST_CASE("a rest pose that stands before the walk stays as it is", "[style][apply]") {
  clip::Clip walk = toy_walk(200);
  walk.channels.row(0).tail(12).array() += 1.5;
  const auto applied = style::apply_to_clip(toy_model(1), "toy", walk, {}).value();
  CHECK(applied.kept_first);
  CHECK(applied.clip.channels.row(0) == walk.channels.row(0));
  CHECK(applied.clip.channels.row(1) != walk.channels.row(1));
  CHECK_FALSE(style::apply_to_clip(toy_model(1), "toy", toy_walk(200), {}).value().kept_first);
}

TEST_CASE("alpha 0 keeps every channel value, and the timecodes", "[style][apply]") {
  clip::Clip walk = toy_walk(50);
  walk.timecode.assign(50, to_timecode("10:20:30:04"));
  const style::Applied same = applied(walk, 0.0);
  CHECK(same.clip.channels == walk.channels);
  CHECK(same.clip.timecode == walk.timecode);
  CHECK(same.joints_changed == 0);
  CHECK(same.rms_change_rad == 0.0);
}

TEST_CASE("positions, rate and skeleton stay; joints outside the space too", "[style][apply]") {
  const clip::Clip walk = toy_walk(50);
  style::StyleModel model = toy_model(1);
  const style::Applied out = applied(walk, 1.0);
  CHECK(out.clip.channels.leftCols(3) == walk.channels.leftCols(3));
  CHECK(out.clip.skeleton == walk.skeleton);
  CHECK(out.clip.frame_rate_hz == walk.frame_rate_hz);
  CHECK(out.clip.frames() == walk.frames());
  CHECK(out.joints_changed == 5);
  CHECK(out.rms_change_rad > 0.05);
  CHECK(out.max_change_rad >= out.rms_change_rad);
}

TEST_CASE("styled angles never jump by a turn", "[style][apply]") {
  clip::Clip walk = toy_walk(300);
  for (int i = 0; i < walk.frames(); ++i) walk.channels(i, 5) = 0.1 * i;  // spins five times
  const style::Applied out = applied(walk, 2.0);
  for (int i = 1; i < walk.frames(); ++i) {
    const auto step = (out.clip.channels.row(i) - out.clip.channels.row(i - 1)).rightCols(15);
    CHECK(step.cwiseAbs().maxCoeff() < 1.0);
  }
}

TEST_CASE("the same walk at another rate gets the same style", "[style][apply]") {
  const style::Applied slow = applied(toy_walk(60, 30.0), 1.0);
  const style::Applied fast = applied(toy_walk(240, 120.0), 1.0);
  for (int i = 0; i < 60; ++i) {
    CHECK(furthest_rad(slow.clip.frame(i), fast.clip.frame(4 * i)) < 5e-3);
  }
}

TEST_CASE("a figure whose feet cannot stand is refused, or styled without", "[style][apply]") {
  const clip::Clip walk = toy_walk(60);  // its legs end at the knee
  style::ApplyOptions options;
  options.feet = feet::RootOptions{};
  CHECK_FALSE(style::apply_to_clip(toy_model(1), "toy.style", walk, options));
  options.needs_feet = false;
  const auto styled = style::apply_to_clip(toy_model(1), "toy.style", walk, options);
  REQUIRE(styled);
  CHECK(styled->no_feet.starts_with("it"));
  CHECK(styled->clip.channels == applied(walk, 1.0).clip.channels);
}

TEST_CASE("a clip that cannot be styled is refused with an error message", "[style][apply]") {
  const auto refusal = [](const clip::Clip& clip, const style::StyleModel& model) {
    const auto result = style::apply_to_clip(model, "fox.style", clip, {});
    return result ? std::string() : result.error().text();
  };
  const clip::Clip walk = toy_walk(5);
  CHECK(refusal(walk, toy_model(1)).empty());
  clip::Clip empty = walk;
  empty.channels.resize(0, 18);
  CHECK(refusal(empty, toy_model(1)).find("toy.bvh") != std::string::npos);
  clip::Clip broken = walk;
  broken.channels(3, 7) = std::nan("");
  CHECK(refusal(broken, toy_model(1)).find("frame 4") != std::string::npos);
  style::StyleModel other = toy_model(1);
  other.space.joints[1] = "Tail";
  CHECK(refusal(walk, other).find("Tail") != std::string::npos);
}
