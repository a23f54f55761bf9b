// A clip's figures beside a corpus of synthetic walkers.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>

#include "models/motion/synthetic_walker.hpp"
#include "models/natural/compare.hpp"
#include "tests/support/backward_tasks.hpp"

namespace posed::natural {
namespace {

using motion::WalkerFamily;

motion::Motion walker(const motion::WalkerOptions& options) {
  auto motion = motion::motion_of(motion::make_walker(options).value()).value();
  motion.skeleton = with_one_trunk(motion.skeleton);
  return motion;
}

motion::PoseSpaceSpec spec_of(const motion::Motion& motion) {
  auto spec = compared_space(*motion.skeleton).value();
  const std::array<const motion::Motion*, 1> one{&motion};
  REQUIRE(motion::set_mean_rotations(one, spec));
  return spec;
}

// What `eval natural` finds of a motion beside twelve marching people.
Comparison beside_marchers(const motion::Motion& motion, TaskRunner& tasks) {
  const auto spec = spec_of(motion);
  std::vector<Figures> corpus;
  for (std::uint32_t person = 1; person <= 12; ++person) {
    corpus.push_back(
        figures_of(walker({.family = WalkerFamily::kMarch, .person = person}), spec).value());
  }
  return compare(figures_of(motion, spec).value(), corpus, tasks, {}).value();
}

Comparison beside_marchers(const motion::Motion& motion) {
  SerialTasks tasks;
  return beside_marchers(motion, tasks);
}

const Placed& figure(const Comparison& comparison, const std::string& name) {
  const auto found = std::ranges::find(comparison.figures, name, &Placed::name);
  REQUIRE(found != comparison.figures.end());
  return *found;
}

}  // namespace

TEST_CASE("another walker of the kind is natural, a trembling or stiff one is not", "[natural]") {
  const auto another = beside_marchers(walker({.family = WalkerFamily::kMarch, .person = 40}));
  REQUIRE(another.figures.size() >= 4);  // synthetic feet may never stand
  for (const Placed& placed : another.figures) {
    INFO(placed.name << ' ' << placed.value << ", corpus " << placed.p5 << " to " << placed.p95);
    CHECK(placed.natural);
    CHECK(placed.p5 <= placed.median);
    CHECK(placed.median <= placed.p95);
  }
  const auto trembling =
      beside_marchers(walker({.family = WalkerFamily::kMarch, .person = 40, .noise_deg = 3.0}));
  CHECK_FALSE(figure(trembling, "jerk").natural);
  CHECK(figure(trembling, "jerk").below == 1.0);
  auto stiff = walker({.family = WalkerFamily::kMarch, .person = 40, .noise_deg = 0.0});
  for (Frame& frame : stiff.frames) frame = stiff.frames.front();
  stiff.frames.back() = walker({.person = 40, .noise_deg = 0.0}).frames.back();
  CHECK_FALSE(figure(beside_marchers(stiff), "frechet_deg2").natural);
}

TEST_CASE("another style is far by its poses, not by its roughness", "[natural]") {
  const auto sway = beside_marchers(walker({.family = WalkerFamily::kSway, .person = 40}));
  CHECK_FALSE(figure(sway, "frechet_deg2").natural);
  CHECK(figure(sway, "beyond_deg").value > figure(sway, "beyond_deg").p95);
  CHECK(figure(sway, "jerk").natural);
}

TEST_CASE("persons are compared by their bones, whatever their joints are called") {
  const auto motion = walker({.family = WalkerFamily::kMarch, .person = 3});
  const auto spec = spec_of(motion);
  CHECK(spec.joints.size() <= 15);
  auto other = motion;
  auto renamed = std::make_shared<Skeleton>(*motion.skeleton);
  for (Joint& joint : renamed->joints) joint.name = "rig:" + joint.name;
  other.skeleton = renamed;
  const Figures figures = figures_of(motion, spec).value();
  const Figures same = figures_of(other, spec).value();
  CHECK(same.jerk == figures.jerk);
  CHECK(same.low_deg == figures.low_deg);
  CHECK(same.limbs_m == figures.limbs_m);
  CHECK(same.lacks.sum() == 0.0);

  renamed->joints[renamed->joint_of(Bone::kHead)].bone.reset();
  const Figures headless = figures_of(other, spec).value();
  CHECK(headless.lacks.sum() == 1.0);
  auto reduced = spec;
  remove_joints({"head", "hips"}, reduced);  // not the root
  CHECK(reduced.joints.size() == spec.joints.size() - 1);
  CHECK(reduced.joints[reduced.root] == "hips");
  CHECK(reduced.mean.size() == reduced.joints.size());
  CHECK(figures_of(motion, reduced).value().jerk == figures_of(other, reduced).value().jerk);
}

TEST_CASE("a corpus of few persons leaves room for another one, a large one says how much") {
  Figures clip = figures_of(motion::Rows(motion::Rows::Random(200, 3) * 10.0), 30.0).value();
  clip.limbs_m = Eigen::VectorXd::Constant(8, 0.3);
  Figures near = clip;
  near.jerk *= 1.4;
  std::vector<Figures> corpus(12, clip);
  SerialTasks tasks;
  const auto alone = compare(near, corpus, tasks, {}).value();
  CHECK(alone.persons == 1);
  CHECK(figure(alone, "jerk").natural);
  for (std::size_t i = 0; i < corpus.size(); ++i) {
    corpus[i].limbs_m *= 1.0 + 0.1 * static_cast<double>(i);
  }
  const auto several = compare(near, corpus, tasks, {}).value();
  CHECK(several.persons == 12);
  CHECK_FALSE(figure(several, "jerk").natural);
}

TEST_CASE("figures keep their bits as a task's numbers, in any order of tasks", "[natural]") {
  const auto motion = walker({.family = WalkerFamily::kMarch, .person = 40});
  Figures figures = figures_of(motion, spec_of(motion)).value();
  figures.slide_cm_s = 2.5;
  figures.sink_cm = 0.25;
  const auto numbers_of = [](const Figures& some) {
    NumberWriter numbers;
    write(some, numbers.add("first"));
    return numbers.add("last").take();
  };
  const TaskResult numbers = numbers_of(figures);
  NumberReader reader(numbers);
  CHECK(reader.text() == "first");
  CHECK(numbers_of(figures_from(reader)) == numbers);
  CHECK(reader.text() == "last");
  test::BackwardTasks backward;
  const auto once = beside_marchers(motion);
  const auto again = beside_marchers(motion, backward);
  REQUIRE(once.figures.size() == again.figures.size());
  for (std::size_t i = 0; i < once.figures.size(); ++i) {
    CHECK(once.figures[i].value == again.figures[i].value);
    CHECK(once.figures[i].p95 == again.figures[i].p95);
  }
}

TEST_CASE("feet that never stand are not natural where all others stand", "[natural]") {
  Figures standing = figures_of(motion::Rows(motion::Rows::Random(200, 3) * 10.0), 30.0).value();
  standing.slide_cm_s = 2.0;
  Figures flying = standing;
  flying.slide_cm_s.reset();
  SerialTasks tasks;
  const auto found = compare(flying, {standing, standing, standing}, tasks, {}).value();
  CHECK_FALSE(figure(found, "slide_cm_s").natural);
  const auto unknown = compare(flying, {standing, standing, standing, flying}, tasks, {}).value();
  CHECK(std::ranges::find(unknown.figures, "slide_cm_s", &Placed::name) == unknown.figures.end());
}

TEST_CASE("a clip without feet has no figures of feet, a short one none at all", "[natural]") {
  motion::Rows angles = motion::Rows::Random(200, 3) * 10.0;
  const Figures hand = figures_of(angles, 30.0).value();
  CHECK_FALSE(hand.slide_cm_s);
  SerialTasks tasks;
  const auto comparison = compare(hand, {hand, hand, hand, hand}, tasks, {}).value();
  CHECK(comparison.figures.size() == 4);
  CHECK(figure(comparison, "beyond_deg").value == 0.0);
  const auto few = figures_of(angles.topRows(48), 30.0);
  REQUIRE_FALSE(few);
  CHECK(few.error().message.find("48 frames") != std::string::npos);
  CHECK(figures_of(angles.topRows(49), 30.0));
}

}  // namespace posed::natural
