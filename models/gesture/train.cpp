#include "models/gesture/train.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <nlohmann/json.hpp>

#include "models/gesture/context_models.hpp"
#include "models/gesture/grow_tree.hpp"
#include "models/gesture/held_poses.hpp"
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

// Checks that the label of every segment has classes, and marks the recorded labels.
Result<> mark_trained(const std::vector<Recording>& recordings, std::vector<Label>& labels) {
  for (const Recording& recording : recordings) {
    if (recording.segments.empty()) return fail("no gesture is labelled", recording.file);
    for (const Segment& segment : recording.segments) {
      const auto found = std::ranges::find(labels, segment.label, &Label::name);
      if (found == labels.end()) {
        return fail("label " + in_quotes(segment.label) +
                        " is in no class; say in a questions file what each finger, or group of "
                        "joints, does (--questions), or let --propose-questions write one",
                    recording.file);
      }
      found->trained = true;
    }
  }
  return {};
}

// [question][context]: does the question's statement hold for the label at its position?
Answers answers_of(const std::vector<Context>& contexts, const Vocabulary& vocabulary, int group) {
  const int statements = vocabulary.statements(group);
  Answers answers(3 * static_cast<std::size_t>(statements));
  for (int q = 0; q < 3 * statements; ++q) {
    for (const Context& context : contexts) {
      const std::array<int, 3> at{context.previous, context.current, context.next};
      answers[q].push_back(vocabulary.holds(group, q % statements, at[q / statements]));
    }
  }
  return answers;
}

// Indices of one group's features among those of all groups: [window][channel of the group].
std::vector<int> features_of_group(const Vocabulary& vocabulary, int group) {
  const ChannelGroup& channels = vocabulary.groups[group];
  std::vector<int> features;
  for (int w = 0; w < kDeltaWindows; ++w) {
    for (int c = 0; c < channels.channels; ++c) {
      features.push_back(w * vocabulary.channels() + channels.first + c);
    }
  }
  return features;
}

GrownTree grow_group(const ContextModels& models, const Vocabulary& vocabulary, int state,
                     int group, double mdl_factor) {
  const std::vector<int> features = features_of_group(vocabulary, group);
  const ChannelGroup& channels = vocabulary.groups[group];
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
    if (models.moves[channels.first + d % channels.channels]) options.counted.push_back(d);
  }
  const Answers answers = answers_of(models.contexts, vocabulary, group);
  return grow_tree(sums, answers, models.floor(features), options);
}

GrownTree grow_durations(const ContextModels& models, const Vocabulary& vocabulary,
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
  const Answers answers = answers_of(models.contexts, vocabulary, Vocabulary::kDurations);
  return grow_tree(sums, answers, VectorXd::Constant(kStates, kMinDurationVariance), options);
}

// Copies a row of values into one of the Gaussian's arrays.
void fill(std::array<std::vector<double>, kDeltaWindows>& to, const VectorXd& row) {
  const Index channels = row.size() / kDeltaWindows;
  for (int w = 0; w < kDeltaWindows; ++w) {
    const auto window = row.segment(w * channels, channels);
    to[w].assign(window.begin(), window.end());
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
  for (int c = 0; c < model.channels(); ++c) {
    double low = recordings.front().angles_rad(0, c);
    double high = low;
    for (const Recording& recording : recordings) {
      low = std::min(low, recording.angles_rad.col(c).minCoeff());
      high = std::max(high, recording.angles_rad.col(c).maxCoeff());
    }
    model.low.push_back(low);
    model.high.push_back(high);
  }
}

}  // namespace

Result<GestureModel> train_gesture(const std::vector<Recording>& recordings,
                                   const TrainOptions& options) {
  GestureModel model;
  static_cast<Vocabulary&>(model) = options.vocabulary;
  model.rate_hz = recordings.front().rate_hz;
  TRY(mark_trained(recordings, model.labels));
  SerialTasks serial;
  TaskRunner& tasks = options.tasks != nullptr ? *options.tasks : serial;
  ContextOptions context_options{options.segmental_rounds, options.rounds, options.embedded_rounds,
                                 options.embedded_slack_s, &tasks,         {}};
  if (options.progress) {
    context_options.progress = [&](double fraction) {
      return options.progress("aligning gestures", kTreesFrom * fraction);
    };
  }
  const auto contexts = TRY(train_contexts(recordings, model.labels, context_options));
  TrainReport report(recordings, contexts, model);
  const auto groups = static_cast<int>(model.groups.size());
  for (int tree = 0; tree < kStates * groups; ++tree) {
    const double fraction = kTreesFrom + (1.0 - kTreesFrom) * tree / (kStates * groups);
    if (options.progress && !options.progress("growing trees", fraction)) {
      return training_stopped();
    }
    const int state = tree / groups;
    const GrownTree grown = grow_group(contexts, model, state, tree % groups, options.mdl_factor);
    report.add_tree(state, tree % groups, grown);
    model.trees[state].push_back(tree_of<GroupGaussian>(grown));
  }
  model.durations = tree_of<DurationGaussian>(grow_durations(contexts, model, options.mdl_factor));
  set_range(recordings, model);
  if (model.is_hand() && (model.tells_none || options.held)) {
    model.held = held_poses(recordings, model.labels);
  }
  model.report_json = report.json_of(model);
  if (options.look) options.look(report.findings());
  return model;
}

std::vector<LabelPose> label_poses(const std::vector<Recording>& recordings) {
  std::map<std::string, std::pair<VectorXd, double>> sums;
  for (const Recording& recording : recordings) {
    for (const Segment& segment : recording.segments) {
      auto& [sum, frames] =
          sums.try_emplace(segment.label, VectorXd::Zero(recording.angles_rad.cols()), 0.0)
              .first->second;
      const Segment held = held_part(segment);
      sum += recording.angles_rad.middleRows(held.begin, held.frames()).colwise().sum();
      frames += held.frames();
    }
  }
  std::vector<LabelPose> poses;
  for (const auto& [name, sum] : sums) {
    const VectorXd mean = sum.first / sum.second;
    poses.push_back({name, {mean.begin(), mean.end()}});
  }
  return poses;
}

}  // namespace posed::gesture
