#include "models/style/train/target_training.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "models/style/model/harmonics.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Result<std::vector<gp::Trained>> fit_styles(const Dataset& all, const std::vector<Lesson>& lessons,
                                            std::vector<TrainingPairs> pairs,
                                            const Kernel& kernel) {
  if (lessons.size() == 1) {
    auto process = TRY(fit_difference(pairs.front(), kernel));
    return std::vector{std::move(process)};
  }
  std::vector<StylePairs> styles;
  styles.reserve(lessons.size());
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    styles.push_back({std::move(pairs[i]), lessons[i].clips});
  }
  std::vector<MatrixXd> cycles;
  for (ClipCycle& clip : clip_cycles(all)) cycles.push_back(std::move(clip.coefficients));
  return fit_differences(styles, cycles, kernel);
}

// The MGPM mean cycle of a group (the mean of its subjects' style points), columns of q only.
MatrixXd mgpm_group_cycle(const Dataset& dataset, std::size_t motion, const std::string& group,
                          const VectorXd& phase) {
  const MgpmFit& fit = dataset.fits[motion];
  VectorXd xi = VectorXd::Zero(fit.params.xi.cols());
  int count = 0;
  for (const Subject& s : dataset.subjects) {
    if (s.motion != dataset.motions[motion] || s.group != group) continue;
    xi += s.xi;
    ++count;
  }
  if (count == 0) return {};
  const MatrixXd live =
      mgpm_cycle(dataset.states[motion], fit.params, xi / count, phase, fit.harmonics);
  MatrixXd all = dataset.column_means[motion].transpose().replicate(phase.size(), 1);
  all(Eigen::all, dataset.live_columns[motion]) += live;
  return all.middleCols(3, dataset.dims());
}

// Speeds count in strides of the sources' mean, not of each clip: what the performer's own stride
// brings back is then the style's speed, where the style strides at another cadence.
void in_strides_of_sources(const std::string& target, Dataset& dataset) {
  for (AlignedClip& clip : dataset.clips) {
    double sum = 0.0;
    int count = 0;
    for (const AlignedClip& other : dataset.clips) {
      if (other.motion != clip.motion || other.group == target) continue;
      sum += 1.0 / other.dtheta;
      ++count;
    }
    clip.root.rightCols(2) *= clip.dtheta * sum / count;
  }
}

// The same inputs and kernel with the pelvis as output, whose differences are found as those of the
// pose.
Result<> learn_roots(const Dataset& all, const std::vector<Lesson>& lessons,
                     std::vector<TrainingPairs> pairs, const Kernel& kernel,
                     std::vector<Learnt>& learnt) {
  const auto lacks_root = [](const AlignedClip& clip) { return clip.root.rows() == 0; };
  if (std::ranges::any_of(all.clips, lacks_root)) return {};
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    Dataset roots = *lessons[i].data;
    in_strides_of_sources(lessons[i].target, roots);
    for (AlignedClip& clip : roots.clips) clip.q = clip.root;
    pairs[i].outputs = make_training_pairs(roots, clip_cycles(roots), lessons[i].target).outputs;
    learnt[i].root.emplace().limit =
        kLimitFactor * grid_outputs(pairs[i].outputs).cwiseAbs().colwise().maxCoeff().transpose();
  }
  const auto fitted = TRY(fit_styles(all, lessons, std::move(pairs), kernel));
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    const double scale = std::exp(fitted[i].lambda - learnt[i].process.lambda);
    learnt[i].root->function = {scale * fitted[i].weights, fitted[i].offset};
  }
  return {};
}

}  // namespace

bool is_in(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

int cycle_frames(const Dataset& dataset, const std::string& motion) {
  double sum = 0.0;
  const auto members = dataset.clips_of(motion);
  for (const int c : members) sum += dataset.clips[c].dtheta;
  return static_cast<int>(
      std::lround(2.0 * std::numbers::pi * static_cast<double>(members.size()) / sum));
}

std::vector<Lesson> lessons_of(const Dataset& all, const std::vector<std::string>& targets) {
  std::vector<Lesson> lessons(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i) {
    Lesson& lesson = lessons[i];
    lesson.target = targets[i];
    lesson.data = &all;
    if (targets.size() == 1) continue;
    lesson.data = &lesson.own;
    lesson.own.spec = all.spec;
    lesson.own.rate_hz = all.rate_hz;
    lesson.own.kernel_scale = all.kernel_scale;
    lesson.own.motions = all.motions;
    lesson.own.subjects = all.subjects;
    for (int c = 0; c < std::ssize(all.clips); ++c) {
      const AlignedClip& clip = all.clips[c];
      if (clip.group != lesson.target && is_in(targets, clip.group)) continue;
      lesson.clips.push_back(c);
      lesson.own.clips.push_back(clip);
    }
  }
  return lessons;
}

Result<std::vector<Learnt>> learn_default(const Dataset& all, const std::vector<Lesson>& lessons,
                                          TaskRunner& tasks, const FoldProgress& progress) {
  std::vector<TrainingPairs> pairs;
  std::vector<LeaveOut> leave_outs;
  bool held_out = false;
  for (const Lesson& lesson : lessons) {
    pairs.push_back(make_training_pairs(*lesson.data, clip_cycles(*lesson.data), lesson.target));
    leave_outs.push_back(make_folds(*lesson.data, lesson.target));
    held_out = held_out || (leave_outs.back().folds > 0 && !leave_outs.back().halves);
    if (leave_outs.back().folds == 0) leave_outs.back().pairs = pairs.back();
  }
  const auto chosen = choose_kernel(leave_outs, tasks, progress);
  if (!chosen) return training_stopped();
  const std::string how = held_out ? "leave-out" : "default";
  std::vector<Learnt> learnt;
  learnt.reserve(lessons.size());
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    learnt.push_back({.process = {},
                      .differences = grid_outputs(pairs[i].outputs),
                      .length_chosen_by = how,
                      .way = chosen->way(i),
                      .held_out = std::move(leave_outs[i].held_out),
                      .ways = chosen->folds[i],
                      .tried = chosen->tried});
  }
  auto processes = TRY(fit_styles(all, lessons, pairs, chosen->kernel));
  for (std::size_t i = 0; i < lessons.size(); ++i) learnt[i].process = std::move(processes[i]);
  TRY(learn_roots(all, lessons, std::move(pairs), chosen->kernel, learnt));
  return learnt;
}

Result<std::vector<Learnt>> learn_paper(const Dataset& dataset, const std::string& target,
                                        TaskRunner& tasks, const FoldProgress& progress) {
  std::set<std::string> sources;
  for (const Subject& s : dataset.subjects) {
    if (s.group != target) sources.insert(s.group);
  }
  MatrixXd X(0, dataset.dims());
  MatrixXd Y(0, dataset.dims());
  for (std::size_t m = 0; m < dataset.motions.size(); ++m) {
    const VectorXd phase = cycle_phases(cycle_frames(dataset, dataset.motions[m]));
    const MatrixXd goal = mgpm_group_cycle(dataset, m, target, phase);
    for (const std::string& group : sources) {
      const MatrixXd cycle = mgpm_group_cycle(dataset, m, group, phase);
      if (cycle.size() == 0) continue;
      X.conservativeResize(X.rows() + cycle.rows(), Eigen::NoChange);
      Y.conservativeResize(X.rows(), Eigen::NoChange);
      X.bottomRows(cycle.rows()) = cycle;
      Y.bottomRows(cycle.rows()) = goal - cycle;
    }
  }
  // One task: its runner looks for a stop meanwhile.
  const auto search = [&](std::size_t /*task*/) -> TaskResult {
    const VectorXd found = paper_kernel(X, Y, [&tasks] { return tasks.stopping(); }).vector();
    return {found.begin(), found.end()};
  };
  const auto found =
      tasks.run(1, search, [&](std::size_t /*done*/) { return !progress || progress(0.0); });
  if (!found) return training_stopped();
  auto process =
      TRY(fit_paper(X, Y, gp::Hyper::of(Eigen::Map<const VectorXd>(found->front().data(), 4))));
  return std::vector{Learnt{std::move(process), Y, "evidence"}};
}

}  // namespace posed::style
