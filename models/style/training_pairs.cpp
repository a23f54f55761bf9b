#include "models/style/training_pairs.hpp"

#include <cmath>
#include <numbers>

#include "models/style/harmonics.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd zeros_like(const MatrixXd& m) { return MatrixXd::Zero(m.rows(), m.cols()); }

int subjects_in(const Dataset& dataset, const Subject& like) {
  int count = 0;
  for (const Subject& s : dataset.subjects) {
    count += s.group == like.group && s.motion == like.motion ? 1 : 0;
  }
  return count;
}

// The difference that training assigns to a source subject's frames, at these phases.
MatrixXd difference_at(const MatrixXd& delta, const VectorXd& phase) {
  return harmonic_basis(phase, kCycleHarmonics) * delta;
}

// One fold for each source subject whose group has other subjects; those are trained on.
std::vector<Fold> subject_folds(const Dataset& dataset, const std::vector<SubjectCycle>& cycles,
                                const std::string& target, const std::string& first_source) {
  std::vector<Fold> folds;
  for (const AlignedClip& clip : dataset.clips) {
    const Subject& subject = dataset.subjects[clip.subject];
    if (clip.group == target || subjects_in(dataset, subject) < 2) continue;
    const MatrixXd goal = group_cycle(dataset, cycles, target, clip.motion);
    if (goal.size() == 0) continue;
    std::vector<SubjectCycle> others;
    for (const SubjectCycle& cycle : cycles) {
      if (cycle.subject != clip.subject) others.push_back(cycle);
    }
    const MatrixXd delta = goal - group_cycle(dataset, others, clip.group, clip.motion);
    folds.push_back({make_training_pairs(dataset, others, target, first_source), clip.q,
                     difference_at(delta, clip.phase()), clip.phase(), goal, delta.row(0)});
  }
  return folds;
}

// The clip's rows [first, first + count), with the phase at which they start.
AlignedClip part_of(const AlignedClip& clip, Eigen::Index first, Eigen::Index count) {
  AlignedClip part;
  part.group = clip.group;
  part.motion = clip.motion;
  part.subject = clip.subject;
  part.q = clip.q.middleRows(first, count);
  part.theta0 = clip.theta0 + clip.dtheta * static_cast<double>(first);
  part.dtheta = clip.dtheta;
  return part;
}

// Trained on one half of every source clip, tested on the other halves.
std::vector<Fold> half_folds(const Dataset& dataset, const std::string& target,
                             const std::string& first_source) {
  std::vector<Fold> folds;
  for (const int trained_half : {0, 1}) {
    Dataset halves;
    halves.spec = dataset.spec;
    halves.motions = dataset.motions;
    halves.subjects = dataset.subjects;
    std::vector<AlignedClip> tests;
    for (const AlignedClip& clip : dataset.clips) {
      if (clip.group == target) {
        halves.clips.push_back(part_of(clip, 0, clip.q.rows()));
        continue;
      }
      const Eigen::Index middle = clip.q.rows() / 2;
      const double turns = static_cast<double>(middle) * clip.dtheta / (2.0 * std::numbers::pi);
      if (turns < 1.0) return {};
      const Eigen::Index rest = clip.q.rows() - middle;
      const AlignedClip first = part_of(clip, 0, middle);
      const AlignedClip second = part_of(clip, middle, rest);
      halves.clips.push_back(trained_half == 0 ? first : second);
      tests.push_back(trained_half == 0 ? second : first);
    }
    const std::vector<SubjectCycle> cycles = subject_cycles(halves);
    const std::vector<Pairing> training_pairs =
        make_training_pairs(halves, cycles, target, first_source);
    for (const AlignedClip& test : tests) {
      const MatrixXd goal = group_cycle(halves, cycles, target, test.motion);
      if (goal.size() == 0) continue;
      const MatrixXd delta = goal - group_cycle(halves, cycles, test.group, test.motion);
      folds.push_back({training_pairs, test.q, difference_at(delta, test.phase()), test.phase(),
                       goal, delta.row(0)});
    }
  }
  return folds;
}

}  // namespace

std::vector<SubjectCycle> subject_cycles(const Dataset& dataset) {
  std::vector<SubjectCycle> cycles;
  for (int s = 0; s < std::ssize(dataset.subjects); ++s) {
    MatrixXd sum;
    int clips = 0;
    for (const AlignedClip& clip : dataset.clips) {
      if (clip.subject != s) continue;
      const MatrixXd c = fit_harmonics(clip.phase(), clip.q, kCycleHarmonics);
      sum = clips == 0 ? c : MatrixXd(sum + c);
      ++clips;
    }
    if (clips > 0) cycles.push_back({s, sum / clips});
  }
  return cycles;
}

MatrixXd group_cycle(const Dataset& dataset, const std::vector<SubjectCycle>& cycles,
                     const std::string& group, const std::string& motion) {
  MatrixXd sum;
  int subjects = 0;
  for (const SubjectCycle& cycle : cycles) {
    const Subject& subject = dataset.subjects[cycle.subject];
    if (subject.group != group || subject.motion != motion) continue;
    sum = subjects == 0 ? cycle.coefficients : MatrixXd(sum + cycle.coefficients);
    ++subjects;
  }
  return subjects == 0 ? sum : MatrixXd(sum / subjects);
}

std::vector<Pairing> make_training_pairs(const Dataset& dataset,
                                         const std::vector<SubjectCycle>& cycles,
                                         const std::string& target,
                                         const std::string& first_source) {
  std::vector<Pairing> training_pairs;
  for (const std::string& motion : dataset.motions) {
    const MatrixXd goal = group_cycle(dataset, cycles, target, motion);
    if (goal.size() == 0) continue;
    std::vector<Pairing> own;  // of the target: the difference is zero
    bool covered = false;
    for (const SubjectCycle& cycle : cycles) {
      const Subject& subject = dataset.subjects[cycle.subject];
      if (subject.motion != motion) continue;
      if (subject.group == target) {
        own.push_back({cycle.coefficients, zeros_like(cycle.coefficients), false});
        continue;
      }
      covered = true;
      training_pairs.push_back({cycle.coefficients,
                                goal - group_cycle(dataset, cycles, subject.group, motion),
                                subject.group == first_source});
    }
    if (covered) training_pairs.insert(training_pairs.end(), own.begin(), own.end());
  }
  return training_pairs;
}

std::vector<Fold> make_folds(const Dataset& dataset, const std::string& target,
                             const std::string& first_source) {
  auto folds = subject_folds(dataset, subject_cycles(dataset), target, first_source);
  return folds.empty() ? half_folds(dataset, target, first_source) : folds;
}

}  // namespace posed::style
