#include "models/style/train/training_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "models/style/train/harmonics.hpp"
#include "models/style/train/recording_days.hpp"

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

// Everybody with a clip of this group and motion, in the clips' order.
std::vector<std::string> people_in(const Dataset& dataset, const Cycles& cycles,
                                   const std::string& group, const std::string& motion) {
  std::vector<std::string> people;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = clip_of(dataset, cycle);
    if (clip.group != group || clip.motion != motion) continue;
    const std::string& name = person_of(dataset, clip);
    if (std::ranges::find(people, name) == people.end()) people.push_back(name);
  }
  return people;
}

Difference difference_of(const Dataset& dataset, const Cycles& cycles, const std::string& target,
                         const std::string& group, const std::string& motion) {
  Difference found{motion, group, {}, 0};
  for (const std::string& person : people_in(dataset, cycles, group, motion)) {
    const MatrixXd goal = group_cycle(dataset, cycles, target, motion, person);
    if (goal.size() == 0) continue;
    const MatrixXd own = goal - group_cycle(dataset, cycles, group, motion, person);
    found.delta = found.people == 0 ? own : MatrixXd(found.delta + own);
    ++found.people;
  }
  if (found.people > 0) {
    found.delta /= found.people;
  } else {
    found.delta =
        group_cycle(dataset, cycles, target, motion) - group_cycle(dataset, cycles, group, motion);
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

bool same_differences(const std::vector<Difference>& a, const std::vector<Difference>& b) {
  return std::ranges::equal(a, b, [](const Difference& x, const Difference& y) {
    return x.group == y.group && x.motion == y.motion && (x.people > 0) == (y.people > 0);
  });
}

// The fold that asks for the difference on the frames of one clip, learnt without some. What it
// should get is what the others show; where days are followed, what it shows itself.
Fold fold_of(const Dataset& dataset, const Cycles& cycles, std::size_t asked,
             std::vector<int> left_out, const TrainingPairs& all, const std::string& target) {
  const AlignedClip& clip = clip_of(dataset, cycles[asked]);
  const auto differences = differences_of(dataset, without(cycles, left_out), target);
  const Difference& shown = differences[index_of(differences, clip)];
  const std::size_t own = all.outputs.of_input[asked];
  Fold fold;
  fold.truth = own < differences.size() ? shown.delta : all.outputs.differences[own];
  fold.goal = goal_of(dataset, cycles, clip, shown, target);
  fold.outputs = make_training_pairs(dataset, cycles, target, left_out).outputs;
  fold.left_out = std::move(left_out);
  fold.q = clip.q;
  fold.phase = clip.phase();
  return fold;
}

// What to leave out to ask for this clip: all of its person, else the clip alone; nothing where
// either would leave too little to learn the same differences from.
std::vector<int> leave_out_for(const Dataset& dataset, const Cycles& cycles,
                               const std::string& target, std::size_t asked,
                               const std::vector<Difference>& all) {
  const AlignedClip& clip = clip_of(dataset, cycles[asked]);
  std::vector<int> person;
  for (int i = 0; i < std::ssize(cycles); ++i) {
    const AlignedClip& other = clip_of(dataset, cycles[i]);
    if (person_of(dataset, other) == person_of(dataset, clip)) person.push_back(i);
  }
  for (auto& left_out : {person, std::vector<int>{static_cast<int>(asked)}}) {
    const Cycles kept = without(cycles, left_out);
    if (same_differences(differences_of(dataset, kept, target), all)) return left_out;
  }
  return {};
}

// What one fold asks for and leaves out; the fold itself is built from it.
struct FoldPlan {
  std::size_t asked;  // index of a clip
  std::vector<int> left_out;
};

std::vector<FoldPlan> clip_folds(const Dataset& dataset, const Cycles& cycles,
                                 const std::string& target) {
  const auto all = differences_of(dataset, cycles, target);
  std::vector<FoldPlan> folds;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    const AlignedClip& clip = clip_of(dataset, cycles[i]);
    if (index_of(all, clip) == kNoDifference) continue;
    std::vector<int> left_out = leave_out_for(dataset, cycles, target, i, all);
    if (left_out.empty()) continue;
    folds.push_back({i, std::move(left_out)});
  }
  return folds;
}

LeaveOut planned(std::shared_ptr<const Dataset> dataset, Cycles cycles, TrainingPairs pairs,
                 std::vector<FoldPlan> plans, const std::string& target) {
  LeaveOut result{std::move(pairs), plans.size(), {}, {}};
  for (const FoldPlan& plan : plans) {
    const AlignedClip& clip = clip_of(*dataset, cycles[plan.asked]);
    result.held_out.push_back(
        {clip.file, person_of(*dataset, clip), static_cast<int>(plan.left_out.size())});
  }
  result.fold = [dataset = std::move(dataset), cycles = std::move(cycles), pairs = result.pairs,
                 plans = std::move(plans), target](std::size_t index) {
    const FoldPlan& plan = plans[index];
    return fold_of(*dataset, cycles, plan.asked, plan.left_out, pairs, target);
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

// Trained on one half of every source clip, tested on the other halves.
LeaveOut half_folds(const Dataset& dataset, const std::string& target) {
  const auto parts = std::make_shared<Dataset>();
  parts->motions = dataset.motions;
  parts->subjects = dataset.subjects;
  std::vector<int> halves[2];  // of the source clips: which parts are first and second ones
  for (const AlignedClip& clip : dataset.clips) {
    const Eigen::Index frames = clip.q.rows();
    if (clip.group == target) {
      parts->clips.push_back(part_of(clip, 0, frames));
      continue;
    }
    const Eigen::Index middle = frames / 2;
    const VectorXd phase = clip.phase();
    if (phase[middle] - phase[0] < 2.0 * std::numbers::pi) return {};
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
      if (pairs.outputs.of_input[i] != kNoDifference) folds.push_back({i, tested});
    }
  }
  return planned(parts, std::move(cycles), std::move(pairs), std::move(folds), target);
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
                     const std::string& motion, const std::string& person) {
  if (person.empty()) {
    MatrixXd sum;
    const auto people = people_in(dataset, cycles, group, motion);
    for (const std::string& name : people) {
      const MatrixXd own = group_cycle(dataset, cycles, group, motion, name);
      sum = sum.size() == 0 ? own : MatrixXd(sum + own);
    }
    return people.empty() ? sum : MatrixXd(sum / static_cast<double>(people.size()));
  }
  MatrixXd sum;
  int count = 0;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = clip_of(dataset, cycle);
    if (clip.group != group || clip.motion != motion || person_of(dataset, clip) != person)
      continue;
    sum = count == 0 ? cycle.coefficients : MatrixXd(sum + cycle.coefficients);
    ++count;
  }
  return count == 0 ? sum : MatrixXd(sum / count);
}

std::vector<Difference> differences_of(const Dataset& dataset, const Cycles& cycles,
                                       const std::string& target) {
  std::vector<Difference> found;
  for (const ClipCycle& cycle : cycles) {
    const AlignedClip& clip = clip_of(dataset, cycle);
    if (clip.group == target || index_of(found, clip) != kNoDifference) continue;
    if (people_in(dataset, cycles, target, clip.motion).empty()) continue;
    found.push_back(difference_of(dataset, cycles, target, clip.group, clip.motion));
  }
  return found;
}

MatrixXd goal_of(const Dataset& dataset, const Cycles& cycles, const AlignedClip& clip,
                 const Difference& difference, const std::string& target) {
  MatrixXd own = group_cycle(dataset, cycles, target, clip.motion, person_of(dataset, clip));
  if (own.size() > 0) return own;
  if (difference.people == 0) return group_cycle(dataset, cycles, target, clip.motion);
  return fit_harmonics(clip.phase(), clip.q, kCycleHarmonics) + difference.delta;
}

TrainingPairs make_training_pairs(const Dataset& dataset, const Cycles& cycles,
                                  const std::string& target, const std::vector<int>& left_out) {
  const auto differences = differences_of(dataset, without(cycles, left_out), target);
  TrainingPairs pairs;
  Outputs& outputs = pairs.outputs;
  outputs.offset = Eigen::RowVectorXd::Zero(cycles.front().coefficients.cols());
  for (const Difference& d : differences) {
    outputs.differences.push_back(d.delta);
    outputs.offset += d.delta.row(0) / static_cast<double>(differences.size());
  }
  for (const ClipCycle& cycle : cycles) {
    pairs.inputs.push_back(cycle.coefficients);
    outputs.of_input.push_back(index_of(differences, clip_of(dataset, cycle)));
  }
  for (auto& [clip, day] : day_changes(dataset, cycles, left_out, target)) {
    pairs.follows_days = true;
    int& index = outputs.of_input[clip];
    day += outputs.differences[index];
    index = static_cast<int>(std::ssize(outputs.differences));
    outputs.differences.push_back(std::move(day));
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
