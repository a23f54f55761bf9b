// The figures of models/style/README.md ("Figures") on real recordings; a hidden test that prints
// them: unit_models "[figures]". Takes that train are never judged.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "models/feet/foot_score.hpp"
#include "models/feet/legs.hpp"
#include "models/motion/motion.hpp"
#include "models/style/judge/body_cycle.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/live/body_mask.hpp"
#include "models/style/model/harmonics.hpp"
#include "models/style/model/stride_phase.hpp"
#include "models/style/train/train.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using Eigen::MatrixXd;

namespace style_figures {  // files are joined, and others have takes and recordings, too
namespace {

const std::vector<std::string> kStyles{"active",   "elderly",   "exhausted",
                                       "feminine", "masculine", "youthful"};

const clip::Clip& recording(const std::string& name) {
  static std::map<std::string, clip::Clip> read;
  const auto known = read.find(name);
  if (known != read.end()) return known->second;
  const auto path = test::shared("data/styles/" + name + ".bvh");
  INFO(name);
  REQUIRE(path);
  return read.emplace(name, clip::read_clip(*path).value()).first->second;
}

bool recorded(const std::string& name) {
  return test::shared("data/styles/" + name + ".bvh").has_value();
}

std::string take(const std::string& group, int number, const std::string& motion = "walk") {
  char text[100];
  std::snprintf(text, sizeof(text), "dataset-2_%s_%s_%03d", motion.c_str(), group.c_str(), number);
  return text;
}

// Those of the numbers that were recorded.
std::vector<std::string> takes(const std::string& group, const std::vector<int>& numbers,
                               const std::string& motion = "walk") {
  std::vector<std::string> found;
  for (const int number : numbers) {
    if (recorded(take(group, number, motion))) found.push_back(take(group, number, motion));
  }
  return found;
}

clip::Clip part(const clip::Clip& clip, double from, double to) {
  clip::Clip piece = clip;
  const auto first = static_cast<Eigen::Index>(from * clip.frames());
  const auto end = static_cast<Eigen::Index>(to * clip.frames());
  piece.channels = clip.channels.middleRows(first, end - first).eval();
  piece.path += from == 0.0 ? " (begin)" : " (end)";
  return piece;
}

struct Lessons {
  std::vector<style::TrainingClip> clips;

  Lessons& add(const clip::Clip& clip, const std::string& group, const std::string& who = "ann",
               const std::string& day = "", const std::string& motion = "walk") {
    clips.push_back({clip, group, who, motion, day});
    return *this;
  }
  Lessons& add(const std::vector<std::string>& names, const std::string& group,
               const std::string& who = "ann", const std::string& day = "",
               const std::string& motion = "walk") {
    for (const std::string& name : names) add(recording(name), group, who, day, motion);
    return *this;
  }
  [[nodiscard]] style::StyleModel model(motion::Space space = motion::Space::kHumanoid) const {
    style::TrainOptions options;
    options.target = "to";
    options.dataset.space = space;
    auto trained = style::train_style(clips, options);
    if (!trained) UNSCOPED_INFO(trained.error().message);
    REQUIRE(trained);
    return *std::move(trained);
  }
};

// The mean cycle of each clip [28 x D] in local rotations about the first one's mean, without the
// root. Phases follow the strides, and frames that stand do not count. Where `last_as_before`, the
// last clip has the phases of the one before, which it was made from.
// Joints whose bones are of `but` do not count.
std::vector<MatrixXd> cycles_of(const std::vector<clip::Clip>& clips, bool last_as_before = false,
                                std::optional<style::BodyPart> but = {}) {
  std::vector<motion::Motion> motions;
  for (const clip::Clip& one : clips) {
    motions.push_back(motion::resample(motion::motion_of(one).value(), 30.0));
  }
  const auto kind =
      motion::is_person(*clips[0].skeleton) ? motion::Space::kHumanoid : motion::Space::kNative;
  auto spec = motion::describe_space(kind, *clips[0].skeleton).value();
  const motion::Motion* const reference[] = {motions.data()};
  REQUIRE(motion::set_mean_rotations(reference, spec));
  std::vector<MatrixXd> found;
  style::StridePhase strides;
  Eigen::VectorXd phase;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const auto space = motion::PoseSpace::bind(spec, *motions[i].skeleton).value();
    const MatrixXd q =
        motion::pose_vectors(motions[i], space, motion::walk_heading_rad(motions[i]));
    if (!last_as_before || i + 1 < clips.size()) {
      const Eigen::VectorXd leg = motion::leg_signal(motions[i]).value();
      strides = style::follow_strides(leg, 30.0);
      phase = strides.phase(strides.strides);
      phase.array() -= style::first_harmonic_phase(phase, leg(strides.strides));
    }
    std::vector<int> dims;
    for (int d = 0; d < space.dims(); ++d) {
      if (space.joint_of_dim(d) == spec.root) continue;
      const int joint = space.skeleton_joint_of_dim(d);
      if (but && style::part_of_joint(*motions[i].skeleton, joint) == *but) continue;
      dims.push_back(d);
    }
    const MatrixXd kept = q(strides.strides, dims);
    found.push_back(style::grid_basis() *
                    style::fit_harmonics(phase, kept, style::kCycleHarmonics));
  }
  return found;
}

MatrixXd mean_of(const std::vector<MatrixXd>& all, std::size_t first, std::size_t count) {
  MatrixXd sum = all[first];
  for (std::size_t i = 1; i < count; ++i) sum += all[first + i];
  return sum / static_cast<double>(count);
}

clip::Clip styled(const style::StyleModel& model, const clip::Clip& source,
                  const clip::Clip* neutral = nullptr) {
  style::ApplyOptions options;
  if (neutral != nullptr) options.walker = style::measure_walker(model, "m", *neutral).value();
  return style::apply_to_clip(model, "m", source, options).value().clip;
}

// The error of the styled mean cycle to the target's over the unstyled one, mean over sources.
double cycle_error(const style::StyleModel& model, const std::vector<clip::Clip>& sources,
                   const std::vector<std::string>& targets, const clip::Clip* neutral = nullptr,
                   std::optional<style::BodyPart> but = {}) {
  double sum = 0.0;
  for (const clip::Clip& source : sources) {
    std::vector<clip::Clip> clips;
    for (const auto& name : targets) clips.push_back(recording(name));
    clips.push_back(source);
    clips.push_back(styled(model, source, neutral));
    const auto cycles = cycles_of(clips, true, but);
    const MatrixXd goal = mean_of(cycles, 0, targets.size());
    const auto n = targets.size();
    sum += (cycles[n + 1] - goal).norm() / (cycles[n] - goal).norm();
  }
  return sum / static_cast<double>(sources.size());
}

std::vector<clip::Clip> clips_of(const std::vector<std::string>& names) {
  std::vector<clip::Clip> clips;
  for (const auto& name : names) clips.push_back(recording(name));
  return clips;
}

// |c(styled) - c(source) - taught| / |taught|; the taught difference is that of the first `n`
// clips of both groups.
double missing(const style::StyleModel& model, const std::vector<std::string>& from,
               const std::vector<std::string>& to, const clip::Clip& source,
               const clip::Clip* neutral) {
  std::vector<clip::Clip> clips = clips_of(from);
  for (const auto& name : to) clips.push_back(recording(name));
  clips.push_back(source);
  clips.push_back(styled(model, source, neutral));
  const auto cycles = cycles_of(clips, true);
  const MatrixXd taught = mean_of(cycles, from.size(), to.size()) - mean_of(cycles, 0, from.size());
  const auto n = from.size() + to.size();
  return (cycles[n + 1] - cycles[n] - taught).norm() / taught.norm();
}

void show(const char* what, const std::vector<double>& values) {
  double sum = 0.0;
  std::string list;
  for (const double value : values) {
    char text[32];
    std::snprintf(text, sizeof(text), " %.3f", value);
    list += text;
    sum += value;
  }
  std::printf("%-44s %.3f  (%s )\n", what, sum / static_cast<double>(values.size()), list.c_str());
  std::fflush(stdout);
}

std::vector<double> of_styles(const std::function<double(const std::string&)>& figure) {
  std::vector<double> values;
  for (const std::string& name : kStyles) values.push_back(figure(name));
  return values;
}

Lessons walks(const std::string& name, const std::vector<int>& numbers) {
  return Lessons().add(takes("normal", numbers), "from").add(takes(name, numbers), "to");
}

}  // namespace

TEST_CASE("figures: six styles", "[.][figures][six]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  show("same day", of_styles([](const std::string& name) {
         return cycle_error(walks(name, {1, 2}).model(), clips_of(takes("normal", {4, 5, 6})),
                            takes(name, {3, 4, 5, 6}));
       }));
  std::vector<double> other;
  std::vector<double> both;
  for (const std::string name : {"feminine", "youthful"}) {
    other.push_back(cycle_error(walks(name, {1, 2}).model(), clips_of(takes("normal", {13, 14})),
                                takes(name, {13, 14})));
    auto lessons = Lessons()
                       .add(takes("normal", {1, 2, 4, 5}), "from", "ann", "monday")
                       .add(takes(name, {1, 2, 4, 5}), "to", "ann", "monday")
                       .add(takes("normal", {13}), "from", "ann", "tuesday")
                       .add(takes(name, {13}), "to", "ann", "tuesday");
    both.push_back(
        cycle_error(lessons.model(), clips_of(takes("normal", {14})), takes(name, {14})));
    std::ranges::reverse(lessons.clips);
    both.push_back(
        cycle_error(lessons.model(), clips_of(takes("normal", {14})), takes(name, {14})));
  }
  show("other day (feminine, youthful)", other);
  show("4 + 1 takes of two days, and reversed", both);
  for (const std::string motion : {"run", "walk-turn-left"}) {
    show(motion.c_str(), of_styles([&](const std::string& name) {
           auto lessons = walks(name, {1, 2});
           lessons.add(takes("normal", {1, 2}, motion), "from", "ann", "", motion)
               .add(takes(name, {1, 2}, motion), "to", "ann", "", motion);
           const std::vector<int> judged{3, 4, 5};
           return cycle_error(lessons.model(), clips_of(takes("normal", judged, motion)),
                              takes(name, judged, motion));
         }));
  }
}

TEST_CASE("figures: two people with both styles", "[.][figures][two]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  std::vector<double> a;
  std::vector<double> b;
  std::vector<double> alone_b;
  const clip::Clip& normal = recording("dataset-1_walk_normal_001");
  for (const std::string name : {"active", "feminine", "masculine"}) {
    const std::string file =
        "dataset-1_walk_" + std::string(name == "masculine" ? "masculinity" : name) + "_001";
    const clip::Clip& acted = recording(file);
    const auto lessons = walks(name, {1, 2})
                             .add(part(normal, 0.0, 0.5), "from", "bob")
                             .add(part(acted, 0.0, 0.5), "to", "bob");
    const auto model = lessons.model();
    a.push_back(
        cycle_error(model, clips_of(takes("normal", {4, 5, 6})), takes(name, {3, 4, 5, 6})));
    b.push_back(cycle_error(model, {part(normal, 0.5, 1.0)}, {file}));
    const auto alone =
        Lessons().add(part(normal, 0.0, 0.5), "from").add(part(acted, 0.0, 0.5), "to").model();
    alone_b.push_back(cycle_error(alone, {part(normal, 0.5, 1.0)}, {file}));
  }
  show("two people, A", a);
  show("two people, B (begin -> end)", b);
  show("B alone", alone_b);
}

TEST_CASE("figures: what a stranger misses of the taught difference", "[.][figures][stranger]") {
  if (!recorded("aalto_k_walk_regular")) SKIP_WITHOUT_SHARED();
  std::vector<double> home;
  std::vector<double> cold;
  std::vector<double> warm;
  const std::vector<std::string> manners{"walk_slow", "walk_sad", "limp_regular"};
  for (const auto& [actor, stranger] : {std::pair("k", "t"), std::pair("t", "k")}) {
    const std::string own = std::string("aalto_") + actor + "_";
    const std::string other = std::string("aalto_") + stranger + "_walk_regular";
    for (const std::string& manner : manners) {
      const std::vector<std::string> from{own + "walk_regular"};
      const std::vector<std::string> to{own + manner};
      const auto model = Lessons().add(from, "from").add(to, "to").model();
      home.push_back(missing(model, from, to, recording(from[0]), nullptr));
      cold.push_back(missing(model, from, to, recording(other), nullptr));
      warm.push_back(missing(model, from, to, recording(other), &recording(other)));
    }
  }
  show("Aalto, home", home);
  show("Aalto, stranger, cold", cold);
  show("Aalto, stranger, warmed up", warm);
  std::vector<double> one_two;
  std::vector<double> two_one;
  std::vector<double> three_s;
  const clip::Clip& b = recording("dataset-1_walk_normal_001");
  const clip::Clip begin = part(b, 0.0, 0.5);
  const clip::Clip end = part(b, 0.5, 1.0);
  for (const std::string& name : kStyles) {
    const auto from = takes("normal", {1, 2});
    const auto to = takes(name, {1, 2});
    const auto model = Lessons().add(from, "from").add(to, "to").model();
    two_one.push_back(missing(model, from, to, end, &begin));
    const clip::Clip short_one = part(b, 0.0, 3.0 * b.frame_rate_hz / b.frames());
    three_s.push_back(missing(model, from, to, end, &short_one));
    if (name != "active" && name != "feminine" && name != "masculine") continue;
    const std::vector<std::string> from_b{"dataset-1_walk_normal_001"};
    const std::vector<std::string> to_b{
        "dataset-1_walk_" + std::string(name == "masculine" ? "masculinity" : name) + "_001"};
    const auto of_b = Lessons().add(from_b, "from").add(to_b, "to").model();
    const clip::Clip& neutral = recording(take("normal", 1));
    one_two.push_back(missing(of_b, from_b, to_b, recording(take("normal", 2)), &neutral));
  }
  show("Bandai 2 -> 1, warmed up", two_one);
  show("Bandai 2 -> 1, after 3 s", three_s);
  show("Bandai 1 -> 2, warmed up", one_two);
}

namespace {

// The walk with the rotation channels of some joints replaced: `pose` gives those of a frame.
clip::Clip busy(clip::Clip walk, const std::vector<std::string>& joints,
                const std::function<double(Eigen::Index frame, Eigen::Index column)>& pose) {
  const Skeleton& skeleton = *walk.skeleton;
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    if (channel.translation) continue;
    if (std::ranges::find(joints, skeleton.joints[channel.joint].name) == joints.end()) continue;
    for (Eigen::Index t = 0; t < walk.channels.rows(); ++t) {
      const auto column = static_cast<Eigen::Index>(c);
      walk.channels(t, column) = pose(t, column);
    }
  }
  return walk;
}

// An arm that does what it does in another recording, there and back.
clip::Clip with_arm(const clip::Clip& walk, const std::string& side, const std::string& gesture) {
  const Eigen::MatrixXd& from = recording(gesture).channels;
  return busy(walk, {"Shoulder_" + side, "UpperArm_" + side, "LowerArm_" + side, "Hand_" + side},
              [&](Eigen::Index t, Eigen::Index column) {
                const Eigen::Index at = t % (2 * from.rows() - 1);
                return from(at < from.rows() ? at : 2 * from.rows() - 1 - at, column);
              });
}

// A joint turned by so much about one of its axes, more than it walks.
clip::Clip turned(const clip::Clip& walk, const std::string& joint, Axis axis, double degrees) {
  clip::Clip bent = walk;
  for (std::size_t c = 0; c < walk.skeleton->channels.size(); ++c) {
    const Channel& channel = walk.skeleton->channels[c];
    if (channel.translation || channel.axis != axis) continue;
    if (walk.skeleton->joints[channel.joint].name != joint) continue;
    bent.channels.col(static_cast<Eigen::Index>(c)).array() += degrees * 3.14159265 / 180.0;
  }
  return bent;
}

}  // namespace

TEST_CASE("figures: the rest of the body while a part is busy", "[.][figures][busy]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  using Part = style::BodyPart;
  struct Gesture {
    std::string what;
    Part part;
    std::function<clip::Clip(const clip::Clip&)> on;
  };
  const std::vector<Gesture> gestures{
      {"right arm waves", Part::kRightArm,
       [](const auto& w) { return with_arm(w, "R", take("normal", 1, "wave-right-hand")); }},
      {"left arm waves", Part::kLeftArm,
       [](const auto& w) { return with_arm(w, "L", take("normal", 1, "wave-left-hand")); }},
      {"left arm is raised", Part::kLeftArm,
       [](const auto& w) { return with_arm(w, "L", take("normal", 1, "raise-up-left-hand")); }},
      {"right arm hangs (bag)", Part::kRightArm,
       [](const auto& w) {
         return busy(w, {"Shoulder_R", "UpperArm_R", "LowerArm_R", "Hand_R"},
                     [mean = Eigen::RowVectorXd(w.channels.colwise().mean())](
                         Eigen::Index, Eigen::Index column) { return mean[column]; });
       }},
      {"head 60 deg aside", Part::kHead,
       [](const auto& w) { return turned(w, "Neck", Axis::kY, 60.0); }},
      {"bow of 35 deg", Part::kTrunk,
       [](const auto& w) { return turned(w, "Spine", Axis::kX, 35.0); }}};
  for (const auto& gesture : gestures) {
    for (const bool warm : {false, true}) {
      for (const bool acts : {false, true}) {
        const std::string row =
            gesture.what + (warm ? ", warm" : ", cold") + (acts ? "" : " (plain)");
        show(row.c_str(), of_styles([&](const std::string& name) {
               std::vector<clip::Clip> sources = clips_of(takes("normal", {4, 5}));
               const clip::Clip neutral = recording(take("normal", 1));
               for (clip::Clip& source : sources) {
                 if (acts) source = gesture.on(source);
               }
               return cycle_error(walks(name, {1, 2}).model(), sources, takes(name, {3, 4, 5, 6}),
                                  warm ? &neutral : nullptr, gesture.part);
             }));
      }
    }
  }
}

TEST_CASE("a stranger's walk gets what was taught, and a raised arm leaves the rest its style",
          "[style][real]") {
  if (!recorded("aalto_k_walk_regular")) SKIP_WITHOUT_SHARED();
  const std::vector<std::string> from{"aalto_k_walk_regular"};
  const std::vector<std::string> to{"aalto_k_walk_slow"};
  const auto taught = Lessons().add(from, "from").add(to, "to").model();
  const clip::Clip& stranger = recording("aalto_t_walk_regular");
  CHECK(missing(taught, from, to, recording(from[0]), nullptr) <= 0.1);
  CHECK(missing(taught, from, to, stranger, &stranger) <= 0.15);
  const auto model = walks("active", {1, 2}).model();
  const clip::Clip& plain = recording(take("normal", 4));
  const clip::Clip raised = with_arm(plain, "L", take("normal", 1, "raise-up-left-hand"));
  const clip::Clip& neutral = recording(take("normal", 1));
  const auto targets = takes("active", {4, 5, 6});
  const auto rest = [&](const clip::Clip& source) {
    return cycle_error(model, {source}, targets, &neutral, style::BodyPart::kLeftArm);
  };
  CHECK(rest(raised) <= rest(plain) + 0.04);
  // An arm that is busy from one frame to the next: its change fades.
  clip::Clip sudden = plain;
  sudden.channels.bottomRows(plain.frames() / 2) = raised.channels.bottomRows(plain.frames() / 2);
  style::ApplyOptions options;
  options.walker = style::measure_walker(model, "active", neutral).value();
  const clip::Clip styled = style::apply_to_clip(model, "active", sudden, options).value().clip;
  for (const Bone bone : {Bone::kLeftUpperArm, Bone::kLeftLowerArm}) {
    const int joint = plain.skeleton->joint_of(bone);
    const auto change_rad = [&](int frame) {
      const auto turn = [&](const clip::Clip& of) {
        return to_eigen_double(of.frame(frame).rotation_xyzw[static_cast<std::size_t>(joint)]);
      };
      return turn(sudden).angularDistance(turn(styled));
    };
    for (int i = 1; i < plain.frames(); ++i) {
      CAPTURE(i, bone);
      CHECK(std::abs(change_rad(i) - change_rad(i - 1)) < 0.26);
    }
  }
  CHECK(model.roots.size() == 1);
}

namespace {

// Of clips of one rig: the cycle of the pelvis' height [28], in cm of a leg of 83 cm, and its
// speed.
struct Pelvis {
  Eigen::VectorXd height_cm;
  double speed_m_s = 0.0;

  [[nodiscard]] double bounce_cm() const { return height_cm.maxCoeff() - height_cm.minCoeff(); }
};

Pelvis pelvis_of(const clip::Clip& clip, const clip::Clip& strides_of) {
  const auto walk = motion::resample(motion::motion_of(clip).value(), 30.0);
  const auto legs = motion::resample(motion::motion_of(strides_of).value(), 30.0);
  const Eigen::VectorXd leg = motion::leg_signal(legs).value();
  const auto strides = style::follow_strides(leg, 30.0);
  Eigen::VectorXd phase = strides.phase(strides.strides);
  phase.array() -= style::first_harmonic_phase(phase, leg(strides.strides));
  const double length_m = feet::Legs::find(*walk.skeleton).value().length_m();
  const MatrixXd root = motion::root_positions_m(walk, 0.0);
  const Eigen::VectorXd height = root.col(1) * (83.0 / length_m);
  const MatrixXd kept = height(strides.strides);
  const double period_s = 2.0 * 3.14159265 / strides.dtheta / 30.0;
  return {style::grid_basis() * style::fit_harmonics(phase, kept, style::kCycleHarmonics),
          feet::root_speed_m_s(walk, period_s)};
}

double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

}  // namespace

TEST_CASE("figures: height and speed of the pelvis, and sliding feet", "[.][figures][pelvis]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  for (const std::string motion : {"walk", "run"}) {
    std::vector<double> height;
    std::vector<double> bounce;
    std::vector<double> speed;
    std::vector<double> slide;
    std::vector<double> sink;
    std::vector<double> cycle;
    for (const std::string& name : kStyles) {
      auto lessons = walks(name, {1, 2});
      if (motion == "run") {
        lessons.add(takes("normal", {1, 2}, motion), "from", "ann", "", motion)
            .add(takes(name, {1, 2}, motion), "to", "ann", "", motion);
      }
      const auto model = lessons.model();
      const auto targets = takes(name, {3, 4, 5, 6}, motion);
      Pelvis goal;
      for (const auto& target : targets) {
        const Pelvis one = pelvis_of(recording(target), recording(target));
        goal.height_cm = goal.height_cm.size() == 0
                             ? one.height_cm
                             : Eigen::VectorXd(goal.height_cm + one.height_cm);
        goal.speed_m_s += one.speed_m_s / static_cast<double>(targets.size());
      }
      goal.height_cm /= static_cast<double>(targets.size());
      double sums[6] = {};
      const auto sources = clips_of(takes("normal", {4, 5}, motion));
      for (const clip::Clip& source : sources) {
        style::ApplyOptions options;
        options.feet = feet::RootOptions{};
        const auto out = style::apply_to_clip(model, "m", source, options).value().clip;
        const Pelvis got = pelvis_of(out, source);
        const auto before = motion::motion_of(source).value();
        const auto after = motion::motion_of(out).value();
        sums[0] += rms(got.height_cm - goal.height_cm);
        sums[1] += std::abs(got.bounce_cm() - goal.bounce_cm());
        sums[2] += got.speed_m_s / goal.speed_m_s;
        sums[3] += feet::slide_m_s(before, after).value() / feet::slide_m_s(before, before).value();
        sums[4] += 100.0 * feet::sink_m(before, after).value();
        auto judged = clips_of(targets);
        judged.push_back(source);
        judged.push_back(out);
        const auto cycles = cycles_of(judged, true);
        const MatrixXd style = mean_of(cycles, 0, targets.size());
        sums[5] += (cycles.back() - style).norm() / (cycles[targets.size()] - style).norm();
      }
      const auto count = static_cast<double>(sources.size());
      height.push_back(sums[0] / count);
      bounce.push_back(sums[1] / count);
      speed.push_back(sums[2] / count);
      slide.push_back(sums[3] / count);
      sink.push_back(sums[4] / count);
      cycle.push_back(sums[5] / count);
    }
    show((motion + ": height cycle [cm]").c_str(), height);
    show((motion + ": bounce off [cm]").c_str(), bounce);
    show((motion + ": speed over the style's").c_str(), speed);
    show((motion + ": slide over the source's").c_str(), slide);
    show((motion + ": sink [cm]").c_str(), sink);
    show((motion + ": cycle, feet standing").c_str(), cycle);
  }
}

namespace {

clip::Clip walker_of(const std::string& file) {
  const auto path = test::shared("data/cmu/" + file);
  INFO(file);
  REQUIRE(path);
  return clip::read_clip(*path).value();
}

motion::Motion motion_without_t_pose(const clip::Clip& clip) {
  auto motion = motion::motion_of(clip).value();
  if (motion::begins_with_added_pose(motion)) motion::drop_first_frame(motion);
  return motion;
}

}  // namespace

TEST_CASE("figures: what other skeletons get of the directions of bones", "[.][figures][rigs]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  const std::vector<std::string> walkers{"07_01.bvh", "16_16.bvh", "35_02.bvh", "39_01.amc",
                                         "08_01.amc"};
  for (const std::string& name : kStyles) {
    const auto model = walks(name, {1}).model();  // all that `arrival` is told was taught
    const auto source = motion::motion_of(recording(take("normal", 1))).value();
    const auto target = motion::motion_of(recording(take(name, 1))).value();
    std::vector<double> missing;
    std::vector<double> of_arms;
    std::vector<double> arms;
    std::vector<double> worst;
    std::vector<double> lean;
    for (const std::string& file : walkers) {
      const clip::Clip walker = walker_of(file);
      const auto got =
          style::arrival(motion_without_t_pose(walker),
                         motion_without_t_pose(styled(model, walker, &walker)), source, target)
              .value();
      missing.push_back(got.missing);
      of_arms.push_back(got.arms_rad / got.unstyled_arms_rad);
      arms.push_back(got.arms_rad * 180.0 / 3.14159265);
      worst.push_back(got.worst_arm_rad * 180.0 / 3.14159265);
      lean.push_back(got.lean_rad * 180.0 / 3.14159265);
    }
    show((name + ": missing of the directions").c_str(), missing);
    show((name + ": missing of the arms'").c_str(), of_arms);
    show((name + ": arms off [deg]").c_str(), arms);
    show((name + ": worst arm [deg]").c_str(), worst);
    show((name + ": lean beyond [deg]").c_str(), lean);
  }
}

TEST_CASE("figures: the gate", "[.][figures][gates]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  const auto gate = [](const style::StyleModel& model, const std::string& name,
                       const clip::Clip* neutral = nullptr, bool cold = false) {
    style::ApplyOptions options;
    options.cold = cold;
    if (neutral != nullptr) options.walker = style::measure_walker(model, "m", *neutral).value();
    return style::apply_to_clip(model, "m", recording(name), options).value().gate_mean.value();
  };
  const clip::Clip& other = recording("dataset-1_walk_normal_001");
  const clip::Clip& own = recording(take("normal", 1));
  for (const std::string& name : kStyles) {
    const auto model = walks(name, {1, 2}).model();
    std::vector<double> strangers;
    std::vector<double> warm;
    std::vector<double> runs;
    std::vector<double> warm_runs;
    std::vector<double> days;
    for (const std::string manner : {"normal", "feminine", "masculinity", "active"}) {
      strangers.push_back(gate(model, "dataset-1_walk_" + manner + "_001"));
      warm.push_back(gate(model, "dataset-1_walk_" + manner + "_001", &other));
    }
    for (const std::string group :
         {"normal", "active", "elderly", "exhausted", "feminine", "masculine", "youthful"}) {
      runs.push_back(gate(model, take(group, 4, "run")));
      warm_runs.push_back(gate(model, take(group, 4, "run"), &own));
    }
    for (const std::string group : {"normal", "feminine", "youthful"}) {
      days.push_back(gate(model, take(group, 13)));
      days.push_back(gate(model, take(group, 14)));
    }
    show((name + ": gate, dataset-1 walks").c_str(), strangers);
    show((name + ": the same, warmed up").c_str(), warm);
    show((name + ": gate, another day").c_str(), days);
    show((name + ": gate, runs").c_str(), runs);
    show((name + ": the same, warmed up").c_str(), warm_runs);
  }
}

namespace {

// The same walk with so many frames for each of the clip's, straight between them.
clip::Clip with_frames(const clip::Clip& slow, int times) {
  clip::Clip fast = slow;
  fast.frame_rate_hz *= times;
  const Eigen::Index last = slow.channels.rows() - 1;
  fast.channels.resize(last * times + 1, Eigen::NoChange);
  for (Eigen::Index i = 0; i < fast.channels.rows(); ++i) {
    const Eigen::Index at = std::min(i / times, last - 1);
    const double part = static_cast<double>(i - at * times) / times;
    const auto from = slow.channels.row(at);
    Eigen::RowVectorXd step = slow.channels.row(at + 1) - from;
    for (std::size_t c = 0; c < slow.skeleton->channels.size(); ++c) {
      if (slow.skeleton->channels[c].translation) continue;
      double& turn = step[static_cast<Eigen::Index>(c)];
      turn = std::remainder(turn, 2.0 * 3.14159265358979);
    }
    fast.channels.row(i) = from + part * step;
  }
  return fast;
}

// The largest angle between the poses of the same instants at two rates, in degrees.
double apart_at_rates(const style::StyleModel& model, const clip::Clip& walk, int times,
                      bool cold) {
  style::ApplyOptions options;
  options.cold = cold;
  const auto slow = style::apply_to_clip(model, "m", walk, options).value().clip;
  const auto fast =
      style::apply_to_clip(model, "m", with_frames(walk, times), options).value().clip;
  double furthest = 0.0;
  for (int i = 0; i < slow.frames(); ++i) {
    const Frame one = slow.frame(i);
    const Frame other = fast.frame(i * times);
    for (std::size_t j = 0; j < one.joint_count; ++j) {
      furthest = std::max(furthest, angle_between_rad(to_eigen_double(one.rotation_xyzw[j]),
                                                      to_eigen_double(other.rotation_xyzw[j])));
    }
  }
  return furthest * 180.0 / 3.14159265358979;
}

}  // namespace

TEST_CASE("figures: the same pose at any rate", "[.][figures][rates]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  for (const std::string& name : kStyles) {
    const auto model = walks(name, {1, 2}).model();
    for (const bool cold : {false, true}) {
      std::vector<double> apart;
      for (const int take_number : {4, 5, 6}) {
        for (const int times : {2, 4}) {
          apart.push_back(
              apart_at_rates(model, recording(take("normal", take_number)), times, cold));
        }
      }
      show((name + (cold ? ": rates apart, cold [deg]" : ": rates apart, warm [deg]")).c_str(),
           apart);
    }
  }
}

TEST_CASE("a walk gets the same pose at any rate of frames", "[style][real]") {
  if (!recorded(take("normal", 1))) SKIP_WITHOUT_SHARED();
  const auto model = walks("active", {1, 2}).model();
  for (const bool cold : {false, true}) {
    for (const int times : {2, 4}) {
      CHECK(apart_at_rates(model, recording(take("normal", 4)), times, cold) <= 0.5);
    }
  }
}

}  // namespace style_figures
