// The feet stage on input that is no walk: jumps, gaps, bodies without feet that stand, and noise.
#include <catch2/catch.hpp>

#include <limits>
#include <random>

#include "models/feet/foot_score.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/support/seeds.hpp"
#include "tests/unit/models/feet/standing_walker.hpp"

namespace posed::feet {
namespace {

using test::feet_stage;
using test::styled_walk;
using test::StyledWalk;
using test::through;

Eigen::Vector3d offset_of(const Frame& out, const Frame& source) {
  return test::root_of(out) - test::root_of(source);
}

double level_m(const Eigen::Vector3d& v) { return std::hypot(v.x(), v.z()); }

// The styled frame, and the source's, both moved.
struct MovedPair {
  Frame source, styled;
};
MovedPair moved(const test::StyledWalk& walk, std::size_t t, const Eigen::Vector3d& by_m,
                std::int64_t later_ns = 0) {
  MovedPair pair{walk.source.frames[t], walk.styled.frames[t]};
  for (Frame* frame : {&pair.source, &pair.styled}) {
    test::set_root(*frame, test::root_of(*frame) + by_m);
    frame->header.device_ns += later_ns;
  }
  return pair;
}

// The same skeleton without the bones of these legs.
std::shared_ptr<const Skeleton> without(const Skeleton& skeleton, std::vector<std::string> names) {
  auto cut = std::make_shared<Skeleton>(skeleton);
  for (Joint& joint : cut->joints) {
    if (std::ranges::find(names, joint.name) == names.end()) continue;
    joint.bone.reset();
    joint.name = "x" + joint.name;
  }
  cut->finish().value();
  return cut;
}

}  // namespace

// What the stage makes of the last of the first `count` frames of a walk.
Frame after(Stage& stage, const StyledWalk& walk, std::size_t count) {
  Frame out;
  for (std::size_t t = 0; t < count; ++t) {
    out = through(stage, walk.source.frames[t], walk.styled.frames[t]);
  }
  return out;
}

TEST_CASE("after a teleport the avatar is where the performer is", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  for (const char* root : {"stride", "actor"}) {
    const auto stage = feet_stage(walk.source, root);
    Frame out;
    for (std::size_t t = 0; t < 300; ++t) {
      out = through(*stage, walk.source.frames[t], walk.styled.frames[t]);
    }
    CHECK(level_m(offset_of(out, walk.source.frames[299])) > 0.005);
    const MovedPair there = moved(walk, 300, {5.0, 0.0, 0.0});
    out = through(*stage, there.source, there.styled);
    CHECK(level_m(offset_of(out, there.source)) < 1e-6);
    // Its feet are not drawn out to where they stood.
    for (std::size_t t = 301; t < 305; ++t) {
      const MovedPair next = moved(walk, t, {5.0, 0.0, 0.0});
      out = through(*stage, next.source, next.styled);
      CHECK(level_m(offset_of(out, next.source)) < 0.1);
    }
  }
}

TEST_CASE("a file that loops gives the same walk again and again", "[feet]") {
  const auto walk = styled_walk(60.0, 4.0);
  const auto stage = feet_stage(walk.source, "stride");
  std::vector<Eigen::Vector3d> first, last;
  const std::size_t frames = walk.source.frames.size();
  const std::int64_t length_ns = 4'000'000'000;
  for (int loop = 0; loop < 4; ++loop) {
    for (std::size_t t = 0; t < frames; ++t) {
      const MovedPair pair = moved(walk, t, Eigen::Vector3d::Zero(), loop * length_ns);
      const Frame out = through(*stage, pair.source, pair.styled);
      if (loop == 1) first.push_back(offset_of(out, pair.source));
      if (loop == 3) last.push_back(offset_of(out, pair.source));
    }
  }
  for (std::size_t t = 0; t < frames; ++t) CHECK((first[t] - last[t]).norm() < 0.02);
}

TEST_CASE("a silence does not move the avatar beside its performer", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  const auto stage = feet_stage(walk.source, "stride");
  Frame out = after(*stage, walk, 200);
  const Eigen::Vector3d before_m = offset_of(out, walk.source.frames[199]);
  // A second later, a quarter of a metre on.
  const MovedPair pair = moved(walk, 201, {0.0, 0.0, 0.25}, 1'000'000'000);
  out = through(*stage, pair.source, pair.styled);
  CHECK(level_m(offset_of(out, pair.source) - before_m) < 0.02);
}

TEST_CASE("who walks on through a silence is not taken for a teleport", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  const auto stage = feet_stage(walk.source, "stride");
  Frame out = after(*stage, walk, 200);
  const Eigen::Vector3d before_m = offset_of(out, walk.source.frames[199]);
  CHECK(level_m(before_m) > 0.2);
  const MovedPair pair = moved(walk, 200, {0.0, 0.0, 3.0}, 2'000'000'000);
  out = through(*stage, pair.source, pair.styled);
  CHECK(level_m(offset_of(out, pair.source) - before_m) < 0.02);
}

TEST_CASE("one frame without its root does not end the offset", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  const auto root = static_cast<std::size_t>(walk.source.skeleton->root_joint);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const int kind : {0, 1, 2}) {
    INFO(kind);
    const auto stage = feet_stage(walk.source, "stride");
    Frame out;
    for (std::size_t t = 0; t < 200; ++t) {
      out = through(*stage, walk.source.frames[t], walk.styled.frames[t]);
    }
    const Eigen::Vector3d before_m = offset_of(out, walk.source.frames[199]);
    MovedPair bad = moved(walk, 200, Eigen::Vector3d::Zero());
    for (Frame* frame : {&bad.source, &bad.styled}) {
      if (kind != 1) frame->valid[root] = false;
      if (kind == 1) test::set_root(*frame, {nan, 1.0, 0.0});
      if (kind == 2) test::set_root(*frame, Eigen::Vector3d::Zero());
    }
    out = through(*stage, bad.source, bad.styled);
    if (kind != 1) CHECK((offset_of(out, bad.source) - before_m).norm() < 1e-6);
    out = through(*stage, walk.source.frames[201], walk.styled.frames[201]);
    CHECK(level_m(offset_of(out, walk.source.frames[201]) - before_m) < 0.02);
  }
}

TEST_CASE("frames that arrive in pairs give the same root", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  const auto even = feet_stage(walk.source, "stride");
  const auto paired = feet_stage(walk.source, "stride");
  Frame even_out, paired_out;
  for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
    even_out = through(*even, walk.source.frames[t], walk.styled.frames[t]);
    // An odd frame comes 50 us after the one before it.
    const MovedPair pair = moved(walk, t, Eigen::Vector3d::Zero(), t % 2 == 0 ? 0 : -16'616'000);
    paired_out = through(*paired, pair.source, pair.styled);
  }
  const double even_m = level_m(offset_of(even_out, walk.source.frames.back()));
  CHECK(even_m > 0.5);
  CHECK(level_m(test::root_of(paired_out) - test::root_of(even_out)) < 0.1 * even_m);
}

TEST_CASE("a joint that is lost for a frame does not end the hold", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0);
  const Legs legs = Legs::find(*walk.source.skeleton).value();
  const auto foot = static_cast<std::size_t>(legs.leg(0).foot);
  const auto ankle_m = [&](const Frame& frame) {
    LegPose pose;
    legs.pose(frame, pose);
    return pose.point_from_root_m[0][kAnkle];
  };
  double furthest_m = 0.0;
  for (std::size_t lost = 180; lost < 240; lost += 6) {
    const auto stage = feet_stage(walk.source, "actor");
    const auto twin = feet_stage(walk.source, "actor");
    for (std::size_t t = 0; t <= lost + 1; ++t) {
      MovedPair pair = moved(walk, t, Eigen::Vector3d::Zero());
      const Frame whole = through(*twin, pair.source, pair.styled);
      if (t == lost) pair.source.valid[foot] = pair.styled.valid[foot] = false;
      const Frame out = through(*stage, pair.source, pair.styled);
      if (t > lost) furthest_m = std::max(furthest_m, (ankle_m(out) - ankle_m(whole)).norm());
    }
  }
  CHECK(furthest_m < 0.05);  // half of what the hold makes; the joint comes back without a contact
}

TEST_CASE("the slide of a clip leaves out what is not measured", "[feet]") {
  const auto walk = styled_walk(60.0, 3.0);
  const Legs legs = Legs::find(*walk.source.skeleton).value();
  const auto foot = static_cast<std::size_t>(legs.leg(0).foot);
  const double whole_m_s = slide_m_s(walk.source, walk.styled).value();
  auto torn = walk.source;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  torn.frames[60].rotation_xyzw[foot] = {0.0F, 0.0F, nan, 0.0F};
  CHECK(slide_m_s(torn, walk.styled).value() == Approx(whole_m_s).epsilon(0.05));
  auto lost = walk.styled;
  lost.frames[60].valid[foot] = false;
  test::set_leg(*lost.skeleton, legs.leg(0), -0.2, 0.5, lost.frames[60]);
  CHECK(slide_m_s(walk.source, lost).value() == Approx(whole_m_s).epsilon(0.05));
}

TEST_CASE("feet that never stand leave the root with the performer", "[feet]") {
  const auto walk = styled_walk(60.0, 4.0);
  const auto stage = feet_stage(walk.source, "stride");
  for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
    const double time_s = static_cast<double>(t) / 60.0;
    const MovedPair pair = moved(walk, t, {6.0 * time_s, 0.0, 0.0});  // on skates
    const Frame out = through(*stage, pair.source, pair.styled);
    CHECK(level_m(offset_of(out, pair.source)) < 0.05);
    CHECK(std::abs(offset_of(out, pair.source).y()) < 0.3);
  }
}

TEST_CASE("on stairs feet stand, too", "[feet]") {
  const auto walk = styled_walk(60.0, 6.0, 0.12);
  const double before_m_s = slide_m_s(walk.source, walk.styled).value();
  for (const char* root : {"stride", "actor"}) {
    INFO(root);
    const auto stage = feet_stage(walk.source, root);
    CHECK(slide_m_s(walk.source, through(*stage, walk)).value() < 0.35 * before_m_s);
  }
}

TEST_CASE("one leg is enough; a body without legs is refused", "[feet]") {
  auto walk = styled_walk(60.0, 3.0);
  auto one = walk;
  one.source.skeleton = without(*walk.source.skeleton, {"LeftFoot"});
  for (auto* frames : {&one.source.frames, &one.styled.frames}) {
    for (Frame& frame : *frames) frame.skeleton = one.source.skeleton->id;
  }
  const auto stage = feet_stage(one.source, "actor");
  for (std::size_t t = 0; t < one.source.frames.size(); ++t) {
    const Frame out = through(*stage, one.source.frames[t], one.styled.frames[t]);
    CHECK(offset_of(out, one.source.frames[t]).norm() < 0.0801);
  }
  StageContext none{.skeleton = without(*walk.source.skeleton, {"LeftFoot", "RightFoot"}),
                    .rate_hz = 60.0,
                    .parameters = complete_parameters(feet_type().parameters, {}).value()};
  const auto refused = feet_type().make(none, nullptr);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.contains("the skeleton has no leg"));
}

TEST_CASE("frames of another skeleton, or without their original, pass through", "[feet]") {
  const auto walk = styled_walk(60.0, 1.0);
  const auto stage = feet_stage(walk.source, "stride");
  for (std::size_t t = 0; t < 30; ++t) {
    through(*stage, walk.source.frames[t], walk.styled.frames[t]);
  }
  test::LastFrame last;
  stage->process({.frame = walk.styled.frames[30]}, last);
  CHECK(test::same_pose(last.out, walk.styled.frames[30]));
  Frame other = walk.styled.frames[31];
  other.skeleton += 1;
  CHECK(test::same_pose(through(*stage, walk.source.frames[31], other), other));
}

TEST_CASE("whatever comes, the pose stays finite, and twice the same is the same", "[feet]") {
  const auto walk = styled_walk(60.0, 2.0);
  const auto [first, last] = test::seeds(5);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("POSED_SEED=" << seed);
    std::mt19937_64 random(seed);
    const auto draw = [&] { return std::uniform_real_distribution<double>(0.0, 1.0)(random); };
    const char* root = seed % 2 == 0 ? "stride" : "actor";
    const auto stage = feet_stage(walk.source, root);
    const auto twin = feet_stage(walk.source, root);
    for (std::size_t t = 0; t < walk.source.frames.size(); ++t) {
      MovedPair pair = moved(walk, t, {0.0, 0.0, draw() < 0.05 ? 4.0 * draw() : 0.0},
                             draw() < 0.1 ? static_cast<std::int64_t>(1e9 * (draw() - 0.5)) : 0);
      const auto joint = static_cast<std::size_t>(19.0 * draw());
      if (draw() < 0.1) pair.source.valid[joint] = pair.styled.valid[joint] = false;
      if (draw() < 0.05) {
        pair.source.rotation_xyzw[joint] = {0.0F, 0.0F, std::numeric_limits<float>::quiet_NaN(), 0};
      }
      if (draw() < 0.02)
        stage->set(test::parameter_index(feet_type(), "root"), std::floor(3.0 * draw()));
      twin->set(test::parameter_index(feet_type(), "root"),
                stage->state(test::parameter_index(feet_type(), "root")).now);
      const Frame out = through(*stage, pair.source, pair.styled);
      REQUIRE(test::same_pose(out, through(*twin, pair.source, pair.styled)));
      REQUIRE(test::root_of(out).allFinite());
      REQUIRE(offset_of(out, pair.source).norm() < 4.0);
      for (const Quatf& q : out.rotation_xyzw) {
        REQUIRE(std::isfinite(q[0] + q[1] + q[2] + q[3]));
      }
    }
  }
}

}  // namespace posed::feet
