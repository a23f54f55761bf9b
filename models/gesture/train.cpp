#include "models/gesture/train.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <nlohmann/json.hpp>

#include "models/gesture/context_models.hpp"
#include "models/gesture/grow_tree.hpp"
#include "models/gesture/train_report.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMinDurationExamples = 5.0;
constexpr double kTreesFrom =
    0.95;  // of the progress, because the alignments take nearly all of the time
constexpr int kTrees = kStates * kFingers;

// Checks that the label of every segment has classes, and marks the recorded labels.
Result<> mark_trained(const std::vector<Recording>& recordings, std::vector<Label>& labels) {
  for (const Recording& recording : recordings) {
    if (recording.segments.empty()) return fail("no gesture is labelled", recording.file);
    for (const Segment& segment : recording.segments) {
      const auto found = std::ranges::find(labels, segment.label, &Label::name);
      if (found == labels.end()) {
        return fail("label " + in_quotes(segment.label) +
                        " is in no class; say in a questions file what each finger does "
                        "(--questions), or let --propose-questions write one",
                    recording.file);
      }
      found->trained = true;
    }
  }
  return {};
}

// [question][context]: does the label at the question's position belong to its class?
template <typename ClassOf>
Answers answers_of(const std::vector<Context>& contexts, const ClassOf& class_of) {
  Answers answers(kQuestions);
  for (int q = 0; q < kQuestions; ++q) {
    for (const Context& context : contexts) {
      const std::array<int, 3> at{context.previous, context.current, context.next};
      answers[q].push_back(class_of(at[q / kClasses]) == q % kClasses);
    }
  }
  return answers;
}

// Indices of one finger's features among those of all fingers: [window][channel of the finger].
std::vector<int> features_of_finger(int finger) {
  std::vector<int> features;
  for (int w = 0; w < kDeltaWindows; ++w) {
    for (int c = 0; c < kFingerChannels; ++c) {
      features.push_back(w * kHandChannels + finger * kFingerChannels + c);
    }
  }
  return features;
}

GrownTree grow_finger(const ContextModels& models, const std::vector<Label>& labels, int state,
                      int finger, double mdl_factor) {
  const std::vector<int> features = features_of_finger(finger);
  const auto rows = static_cast<Index>(models.contexts.size());
  const auto dims = static_cast<Index>(features.size());
  ContextSums sums{VectorXd(rows), VectorXd(rows), MatrixXd(rows, dims), MatrixXd(rows, dims)};
  for (Index row = 0; row < rows; ++row) {
    const Statistics& from = models.sums[row];
    sums.occupancy[row] = from.occupancy[state];
    sums.examples[row] = from.examples;
    sums.first.row(row) = from.first.row(state)(features);
    sums.second.row(row) = from.second.row(state)(features);
  }
  GrowOptions options;
  options.mdl_factor = mdl_factor;
  for (int d = 0; d < static_cast<int>(dims); ++d) {
    if (models.moves[finger * kFingerChannels + d % kFingerChannels]) options.counted.push_back(d);
  }
  const Answers answers =
      answers_of(models.contexts, [&](int label) { return labels[label].finger_class[finger]; });
  return grow_tree(sums, answers, models.floor(features), options);
}

GrownTree grow_durations(const ContextModels& models, const std::vector<Label>& labels,
                         double mdl_factor) {
  const auto rows = static_cast<Index>(models.contexts.size());
  ContextSums sums{VectorXd(rows), VectorXd(rows), MatrixXd(rows, kStates),
                   MatrixXd(rows, kStates)};
  for (Index row = 0; row < rows; ++row) {
    sums.occupancy[row] = sums.examples[row] = models.sums[row].examples;
    sums.first.row(row) = models.sums[row].duration_first;
    sums.second.row(row) = models.sums[row].duration_second;
  }
  const GrowOptions options{.mdl_factor = mdl_factor,
                            .min_occupancy = kMinDurationExamples,
                            .min_examples = kMinDurationExamples,
                            .counted = {0, 1, 2, 3, 4}};
  const Answers answers =
      answers_of(models.contexts, [&](int label) { return majority_class(labels[label]); });
  return grow_tree(sums, answers, VectorXd::Constant(kStates, kMinDurationVariance), options);
}

// Copies a row of values into one of the Gaussian's arrays.
void fill(std::array<std::array<double, kFingerChannels>, kDeltaWindows>& to, const VectorXd& row) {
  for (int w = 0; w < kDeltaWindows; ++w) {
    for (int c = 0; c < kFingerChannels; ++c) to[w][c] = row[w * kFingerChannels + c];
  }
}
void fill(std::array<double, kStates>& to, const VectorXd& row) {
  std::copy(row.begin(), row.end(), to.begin());
}

template <typename Gaussian>
Tree<Gaussian> tree_of(const GrownTree& grown) {
  Tree<Gaussian> tree;
  tree.nodes = grown.nodes;
  tree.leaves.resize(static_cast<std::size_t>(grown.mean.rows()));
  for (Index leaf = 0; leaf < grown.mean.rows(); ++leaf) {
    fill(tree.leaves[leaf].mean, grown.mean.row(leaf));
    fill(tree.leaves[leaf].variance, grown.variance.row(leaf));
    tree.occupancy.push_back(grown.occupancy[leaf]);
  }
  return tree;
}

void set_range(const std::vector<Recording>& recordings, GestureModel& model) {
  for (int c = 0; c < kHandChannels; ++c) {
    model.low[c] = model.high[c] = recordings.front().angles_rad(0, c);
    for (const Recording& recording : recordings) {
      model.low[c] = std::min(model.low[c], recording.angles_rad.col(c).minCoeff());
      model.high[c] = std::max(model.high[c], recording.angles_rad.col(c).maxCoeff());
    }
  }
}

}  // namespace

Result<GestureModel> train_gesture(const std::vector<Recording>& recordings,
                                   const TrainOptions& options) {
  GestureModel model;
  model.rate_hz = recordings.front().rate_hz;
  model.labels = options.labels;
  if (auto marked = mark_trained(recordings, model.labels); !marked) {
    return std::unexpected(marked.error());
  }
  SerialTasks serial;
  TaskRunner& tasks = options.tasks != nullptr ? *options.tasks : serial;
  ContextOptions context_options{options.segmental_rounds, options.rounds, options.embedded_rounds,
                                 options.embedded_slack_s, &tasks,         {}};
  if (options.progress) {
    context_options.progress = [&](double fraction) {
      return options.progress("aligning gestures", kTreesFrom * fraction);
    };
  }
  const auto contexts = train_contexts(recordings, model.labels, context_options);
  if (!contexts) return std::unexpected(contexts.error());
  TrainReport report(recordings, *contexts, model.labels);
  for (int tree = 0; tree < kTrees; ++tree) {
    const double fraction = kTreesFrom + (1.0 - kTreesFrom) * tree / kTrees;
    if (options.progress && !options.progress("growing trees", fraction)) {
      return training_stopped();
    }
    const int state = tree / kFingers;
    const int finger = tree % kFingers;
    const GrownTree grown = grow_finger(*contexts, model.labels, state, finger, options.mdl_factor);
    report.add_tree(state, finger, grown);
    model.trees[state][finger] = tree_of<FingerGaussian>(grown);
  }
  model.durations =
      tree_of<DurationGaussian>(grow_durations(*contexts, model.labels, options.mdl_factor));
  set_range(recordings, model);
  model.report_json = report.json_of(model);
  return model;
}

std::vector<LabelPose> label_poses(const std::vector<Recording>& recordings) {
  std::map<std::string, std::pair<VectorXd, double>> sums;
  for (const Recording& recording : recordings) {
    for (const Segment& segment : recording.segments) {
      auto& [sum, frames] =
          sums.try_emplace(segment.label, VectorXd::Zero(kHandChannels), 0.0).first->second;
      const int from = segment.begin + segment.frames() / 2;
      const int to = segment.end - segment.frames() / 10;
      sum += recording.angles_rad.middleRows(from, to - from).colwise().sum();
      frames += to - from;
    }
  }
  std::vector<LabelPose> poses;
  for (const auto& [name, sum] : sums) {
    LabelPose& pose = poses.emplace_back(LabelPose{name, {}});
    const VectorXd mean = sum.first / sum.second;
    std::copy(mean.begin(), mean.end(), pose.angles_rad.begin());
  }
  return poses;
}

}  // namespace posed::gesture
