#include "models/style/train/training_pairs.hpp"

#include <algorithm>
#include <memory>
#include <numbers>
#include <utility>

#include "models/style/model/harmonics.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Cycles = std::vector<ClipCycle>;

const AlignedClip& clip_of(const Dataset& dataset, const ClipCycle& cycle) {
  return dataset.clips[cycle.clip];
}

const std::string& person_of(const Dataset& dataset, const AlignedClip& clip) {
  return dataset.subjects[clip.subject].name;
}

// Every unit with a clip of this group and motion, in the clips' order.
std::vector<std::string> units_in(const Dataset& dataset, const Cycles& cycles,
                                  const std::string& group, const std::string& motion) {
  std::vector<std::string> units;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = clip_of(dataset, cycle);
    if (clip.group != group || clip.motion != motion) continue;
    std::string name = dataset.unit_of(clip);
    if (std::ranges::find(units, name) == units.end()) units.push_back(std::move(name));
  }
  return units;
}

Difference difference_of(const Dataset& dataset, const Cycles& cycles, const std::string& target,
                         const std::string& group, const std::string& motion) {
  Difference found{motion, group, {}};
  MatrixXd sum =
      MatrixXd::Zero(cycles.front().coefficients.rows(), cycles.front().coefficients.cols());
  for (const std::string& unit : units_in(dataset, cycles, group, motion)) {
    const MatrixXd goal = group_cycle(dataset, cycles, target, motion, unit);
    if (goal.size() == 0) continue;
    MatrixXd own = goal - group_cycle(dataset, cycles, group, motion, unit);
    sum += own;
    found.own.emplace(unit, std::move(own));
  }
  if (found.own.empty()) {
    found.delta =
        group_cycle(dataset, cycles, target, motion) - group_cycle(dataset, cycles, group, motion);
  } else {
    found.delta = sum / static_cast<double>(found.own.size());
  }
  return found;
}

int index_of(const std::vector<Difference>& differences, const AlignedClip& clip) {
  for (std::size_t d = 0; d < differences.size(); ++d) {
    if (differences[d].group == clip.group && differences[d].motion == clip.motion) {
      return static_cast<int>(d);
    }
  }
  return kNoDifference;
}

// What the clip's own unit shows; what all show where it shows none.
const MatrixXd& own_difference(const Dataset& dataset, const Difference& difference,
                               const AlignedClip& clip) {
  const auto own = difference.own.find(dataset.unit_of(clip));
  return own == difference.own.end() ? difference.delta : own->second;
}

// The clips without those at these indices.
Cycles without(const Cycles& cycles, const std::vector<int>& left_out) {
  Cycles kept;
  for (int i = 0; i < std::ssize(cycles); ++i) {
    if (std::ranges::find(left_out, i) == left_out.end()) {
      kept.push_back(cycles[i]);
    }
  }
  return kept;
}

constexpr int kNoGoal = -1;

// What is asked of a clip, and which clips are not learnt from then.
struct FoldPlan {
  std::size_t asked;  // index of a clip
  std::vector<int> left_out;
  bool whole_person = false;
  int goal = kNoGoal;  // index of the target's clip, left out too, that should be reached
};

// The fold that asks for the difference on the frames of one clip, learnt without some: what the
// clip's own unit shows in its other clips, or all others.
Fold fold_of(const Dataset& dataset, const Cycles& cycles, const FoldPlan& plan,
             const std::string& target) {
  const AlignedClip& clip = clip_of(dataset, cycles[plan.asked]);
  const auto differences = differences_of(dataset, without(cycles, plan.left_out), target);
  const Difference& shown = differences[index_of(differences, clip)];
  Fold fold;
  fold.truth = own_difference(dataset, shown, clip);
  if (plan.goal != kNoGoal) {
    fold.goal = cycles[static_cast<std::size_t>(plan.goal)].coefficients;
  } else {
    fold.goal = plan.whole_person ? MatrixXd(cycles[plan.asked].coefficients + shown.delta)
                                  : goal_of(dataset, cycles, clip, shown, target);
  }
  fold.outputs = make_training_pairs(dataset, cycles, target, plan.left_out).outputs;
  fold.left_out = plan.left_out;
  fold.q = clip.q;
  fold.phase = clip.phase();
  return fold;
}

// Whether what is kept shows every motion and group's difference still.
bool all_shown(const std::vector<Difference>& kept, const std::vector<Difference>& all) {
  return std::ranges::equal(kept, all, [](const Difference& a, const Difference& b) {
    return a.group == b.group && a.motion == b.motion && a.own.empty() == b.own.empty();
  });
}

// The clips of a group that are of one unit and motion.
std::vector<int> takes_of(const Dataset& dataset, const Cycles& cycles, const std::string& group,
                          const AlignedClip& like) {
  std::vector<int> takes;
  for (int i = 0; i < std::ssize(cycles); ++i) {
    const AlignedClip& clip = clip_of(dataset, cycles[static_cast<std::size_t>(i)]);
    if (clip.group != group || clip.motion != like.motion) continue;
    if (dataset.unit_of(clip) == dataset.unit_of(like)) takes.push_back(i);
  }
  return takes;
}

// Left out alone where its unit still shows what is asked, else with all of its person. Alone, a
// take of the target that is left out with it says how near it comes to one that nobody learnt.
FoldPlan plan_for(const Dataset& dataset, const Cycles& cycles, const std::string& target,
                  std::size_t asked, const std::vector<Difference>& all) {
  constexpr std::size_t kOthers = 2;
  const AlignedClip& clip = clip_of(dataset, cycles[asked]);
  const std::string unit = dataset.unit_of(clip);
  const bool shows_both = all[index_of(all, clip)].own.contains(unit);
  FoldPlan alone{asked, {static_cast<int>(asked)}};
  const auto goals = takes_of(dataset, cycles, target, clip);
  if (goals.size() >= 2) {
    const auto own = takes_of(dataset, cycles, clip.group, clip);
    const auto turn = std::ranges::find(own, static_cast<int>(asked)) - own.begin();
    alone.goal = goals[static_cast<std::size_t>(turn) % goals.size()];
    alone.left_out.push_back(alone.goal);
  }
  const auto kept = differences_of(dataset, without(cycles, alone.left_out), target);
  if (all_shown(kept, all)) {
    const auto left =
        group_cycle(dataset, without(cycles, alone.left_out), clip.group, clip.motion, unit);
    if (left.size() > 0 || !shows_both) return alone;
  }
  FoldPlan person{asked, {}, true};
  for (int i = 0; i < std::ssize(cycles); ++i) {
    const AlignedClip& other = clip_of(dataset, cycles[i]);
    if (person_of(dataset, other) == person_of(dataset, clip)) person.left_out.push_back(i);
  }
  const auto others = differences_of(dataset, without(cycles, person.left_out), target);
  if (!all_shown(others, all) || others[index_of(others, clip)].own.size() < kOthers) return {};
  return person;
}

std::vector<FoldPlan> clip_folds(const Dataset& dataset, const Cycles& cycles,
                                 const std::string& target) {
  const auto all = differences_of(dataset, cycles, target);
  std::vector<FoldPlan> folds;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    const AlignedClip& clip = clip_of(dataset, cycles[i]);
    if (index_of(all, clip) == kNoDifference) continue;
    FoldPlan plan = plan_for(dataset, cycles, target, i, all);
    if (!plan.left_out.empty()) folds.push_back(std::move(plan));
  }
  return folds;
}

LeaveOut planned(std::shared_ptr<const Dataset> dataset, Cycles cycles, TrainingPairs pairs,
                 std::vector<FoldPlan> plans, const std::string& target) {
  LeaveOut result{.pairs = std::move(pairs), .folds = plans.size()};
  for (const FoldPlan& plan : plans) {
    const AlignedClip& clip = clip_of(*dataset, cycles[plan.asked]);
    result.held_out.push_back(
        {clip.file, person_of(*dataset, clip), static_cast<int>(plan.left_out.size())});
  }
  result.fold = [dataset = std::move(dataset), cycles = std::move(cycles), plans = std::move(plans),
                 target](std::size_t index) {
    return fold_of(*dataset, cycles, plans[index], target);
  };
  return result;
}

// The clip's rows [first, first + count), with their phases.
AlignedClip part_of(const AlignedClip& clip, Eigen::Index first, Eigen::Index count) {
  AlignedClip part;
  part.file = clip.file;
  part.group = clip.group;
  part.motion = clip.motion;
  part.subject = clip.subject;
  part.q = clip.q.middleRows(first, count);
  part.local_phase = clip.phase().segment(first, count);
  return part;
}

// Trained on one half of every clip, tested on the other halves. A clip of the target that is too
// short for that is learnt from as a whole.
LeaveOut half_folds(const Dataset& dataset, const std::string& target) {
  const auto parts = std::make_shared<Dataset>();
  parts->motions = dataset.motions;
  parts->subjects = dataset.subjects;
  parts->kernel_scale = dataset.kernel_scale;
  std::vector<int> halves[2];  // which parts are first and second ones
  for (const AlignedClip& clip : dataset.clips) {
    const Eigen::Index frames = clip.q.rows();
    const Eigen::Index middle = frames / 2;
    const VectorXd phase = clip.phase();
    if (phase[middle] - phase[0] < 2.0 * std::numbers::pi) {
      if (clip.group != target) return {};
      parts->clips.push_back(part_of(clip, 0, frames));
      continue;
    }
    halves[0].push_back(static_cast<int>(std::ssize(parts->clips)));
    parts->clips.push_back(part_of(clip, 0, middle));
    halves[1].push_back(static_cast<int>(std::ssize(parts->clips)));
    parts->clips.push_back(part_of(clip, middle, frames - middle));
  }
  Cycles cycles = clip_cycles(*parts);
  auto pairs = make_training_pairs(*parts, cycles, target);
  std::vector<FoldPlan> folds;
  for (const auto& tested : halves) {
    for (const int part : tested) {
      const std::size_t i = part;
      if (pairs.outputs.of_input[i] == kNoDifference) continue;
      FoldPlan& plan = folds.emplace_back(FoldPlan{i, tested});
      for (const int goal : takes_of(*parts, cycles, target, clip_of(*parts, cycles[i]))) {
        if (std::ranges::find(tested, goal) != tested.end()) plan.goal = goal;
      }
    }
  }
  LeaveOut halved = planned(parts, std::move(cycles), std::move(pairs), std::move(folds), target);
  halved.halves = true;
  return halved;
}

}  // namespace

Cycles clip_cycles(const Dataset& dataset) {
  Cycles cycles;
  for (int c = 0; c < std::ssize(dataset.clips); ++c) {
    const AlignedClip& clip = dataset.clips[c];
    cycles.push_back({c, fit_harmonics(clip.phase(), clip.q, kCycleHarmonics)});
  }
  return cycles;
}

MatrixXd group_cycle(const Dataset& dataset, const Cycles& cycles, const std::string& group,
                     const std::string& motion, const std::string& unit) {
  MatrixXd sum;
  int count = 0;
  const auto add = [&](const MatrixXd& one) { sum = count++ == 0 ? one : MatrixXd(sum + one); };
  if (unit.empty()) {
    for (const std::string& name : units_in(dataset, cycles, group, motion)) {
      add(group_cycle(dataset, cycles, group, motion, name));
    }
  } else {
    for (const ClipCycle& cycle : cycles) {
      const AlignedClip& clip = clip_of(dataset, cycle);
      if (clip.group != group || clip.motion != motion || dataset.unit_of(clip) != unit) continue;
      add(cycle.coefficients);
    }
  }
  return count == 0 ? sum : MatrixXd(sum / count);
}

std::vector<Difference> differences_of(const Dataset& dataset, const Cycles& cycles,
                                       const std::string& target) {
  std::vector<Difference> found;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = clip_of(dataset, cycle);
    if (clip.group == target || index_of(found, clip) != kNoDifference) continue;
    if (units_in(dataset, cycles, target, clip.motion).empty()) continue;
    found.push_back(difference_of(dataset, cycles, target, clip.group, clip.motion));
  }
  return found;
}

MatrixXd goal_of(const Dataset& dataset, const Cycles& cycles, const AlignedClip& clip,
                 const Difference& difference, const std::string& target) {
  MatrixXd own = group_cycle(dataset, cycles, target, clip.motion, dataset.unit_of(clip));
  if (own.size() > 0) return own;
  if (difference.own.empty()) return group_cycle(dataset, cycles, target, clip.motion);
  return fit_harmonics(clip.phase(), clip.q, kCycleHarmonics) + difference.delta;
}

TrainingPairs make_training_pairs(const Dataset& dataset, const Cycles& cycles,
                                  const std::string& target, const std::vector<int>& left_out) {
  const auto differences = differences_of(dataset, without(cycles, left_out), target);
  TrainingPairs pairs;
  pairs.scale = dataset.kernel_scale;
  Outputs& outputs = pairs.outputs;
  outputs.offset = Eigen::RowVectorXd::Zero(cycles.front().coefficients.cols());
  std::vector<std::map<std::string, int>> own(differences.size());  // [difference][unit]
  for (const Difference& d : differences) {
    outputs.differences.push_back(d.delta);
    outputs.offset += d.delta.row(0) / static_cast<double>(differences.size());
  }
  for (std::size_t d = 0; d < differences.size(); ++d) {
    if (differences[d].own.size() < 2) continue;  // the only one is what all show
    for (const auto& [unit, delta] : differences[d].own) {
      own[d][unit] = static_cast<int>(std::ssize(outputs.differences));
      outputs.differences.push_back(delta);
    }
  }
  for (const ClipCycle& cycle : cycles) {
    pairs.inputs.push_back(cycle.coefficients);
    int index = index_of(differences, clip_of(dataset, cycle));
    if (index != kNoDifference) {
      const auto& units = own[static_cast<std::size_t>(index)];
      const auto found = units.find(dataset.unit_of(clip_of(dataset, cycle)));
      if (found != units.end()) index = found->second;
    }
    outputs.of_input.push_back(index);
  }
  return pairs;
}

LeaveOut make_folds(const Dataset& dataset, const std::string& target) {
  Cycles cycles = clip_cycles(dataset);
  auto folds = clip_folds(dataset, cycles, target);
  if (folds.empty()) return half_folds(dataset, target);
  auto pairs = make_training_pairs(dataset, cycles, target);
  // The caller owns it.
  const std::shared_ptr<const Dataset> borrowed(std::shared_ptr<const Dataset>{}, &dataset);
  return planned(borrowed, std::move(cycles), std::move(pairs), std::move(folds), target);
}

}  // namespace posed::style
