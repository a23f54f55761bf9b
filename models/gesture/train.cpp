#include "models/gesture/train.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include "models/gesture/context_models.hpp"
#include "models/gesture/grow_tree.hpp"
#include "models/gesture/train_report.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/median.hpp"
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

constexpr double kSlack_rad = 4.0 * kDegree;  // in every angle, beside the spread over people
constexpr double kKept = 0.98;                // of the poses of people who are left out
// Takes of one person are more alike than people are: the limit is so many times as far.
constexpr double kWidened = 6.0;
constexpr double kMinLimit = 1e-3;  // of a limit, for each channel
constexpr int kWeighings = 10;      // after which the poses' weights hardly change

// The mean of one gesture's held part.
struct HeldPose {
  std::size_t unit;   // left out together
  std::size_t label;  // among the recorded ones
  VectorXd angles_rad;
  double weight;
};

// Of one label's poses.
struct PoseSums {
  double count = 0.0;  // sum of the weights
  VectorXd first;
  MatrixXd second;

  explicit PoseSums(Index channels)
      : first(VectorXd::Zero(channels)), second(MatrixXd::Zero(channels, channels)) {}
  void add(const VectorXd& x, double weight) {
    count += weight;
    first += weight * x;
    second.noalias() += weight * x * x.transpose();
  }
  [[nodiscard]] VectorXd mean() const { return first / count; }
};

constexpr double kNoPose = 1e-9;  // a sum of weights from which all were taken away

struct Whitening {
  std::vector<VectorXd> mean;  // [label]; empty: no pose of it
  Eigen::LLT<MatrixXd> spread;

  [[nodiscard]] double distance(std::size_t label, const VectorXd& x) const {
    return spread.matrixL().solve(x - mean[label]).squaredNorm();
  }
};

// The poses' spread about their label's mean, one for all labels.
Whitening whitening_of(const std::vector<PoseSums>& sums) {
  const Index channels = sums.front().first.size();
  MatrixXd scatter = MatrixXd::Zero(channels, channels);
  Whitening out;
  double freedom = 0.0;
  for (const PoseSums& of : sums) {
    out.mean.emplace_back();
    if (of.count < kNoPose) continue;
    out.mean.back() = of.mean();
    scatter += of.second - of.count * out.mean.back() * out.mean.back().transpose();
    freedom += std::max(of.count - 1.0, 0.0);
  }
  scatter /= std::max(freedom, 1.0);
  scatter.diagonal().array() += kSlack_rad * kSlack_rad;
  out.spread.compute(scatter);
  return out;
}

// People where several are named, else recordings, else each gesture by itself.
std::vector<HeldPose> poses_of(const std::vector<Recording>& recordings,
                               const std::map<std::string, std::size_t>& labels, int people) {
  std::map<std::string, std::size_t> persons;
  std::vector<HeldPose> poses;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    const std::size_t person = persons.try_emplace(recording.person, persons.size()).first->second;
    for (const Segment& segment : recording.segments) {
      const Segment held = held_part(segment);
      const std::size_t unit = people > 1 ? person : recordings.size() > 1 ? r : poses.size();
      poses.push_back({unit, labels.at(segment.label),
                       recording.angles_rad.middleRows(held.begin, held.frames()).colwise().mean(),
                       1.0});
    }
  }
  return poses;
}

std::vector<PoseSums> sums_of(const std::vector<HeldPose>& poses, std::size_t labels) {
  std::vector<PoseSums> sums(labels, PoseSums(poses.front().angles_rad.size()));
  for (const HeldPose& pose : poses) sums[pose.label].add(pose.angles_rad, pose.weight);
  return sums;
}

// Few people who show a gesture their own way would widen the spread for all: a pose counts the
// less the farther it is, as where the errors' distribution has long tails (Student's t).
void weigh(std::vector<HeldPose>& poses, std::size_t labels) {
  for (int round = 0; round < kWeighings; ++round) {
    const Whitening learnt = whitening_of(sums_of(poses, labels));
    std::vector<double> distances;
    for (const HeldPose& pose : poses) {
      distances.push_back(learnt.distance(pose.label, pose.angles_rad));
    }
    const double typical = median(std::vector(distances));
    if (!(typical > 0.0)) return;  // poses that are the same to the bit
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      sum += poses[i].weight = 1.0 / (1.0 + distances[i] / typical);
    }
    for (HeldPose& pose : poses) pose.weight *= static_cast<double>(poses.size()) / sum;
  }
}

// [label][pose] distance of each pose from its label as learnt without the pose's unit.
std::vector<std::vector<double>> distances_left_out(const std::vector<HeldPose>& poses,
                                                    const std::vector<PoseSums>& all) {
  std::map<std::size_t, std::vector<const HeldPose*>> units;
  for (const HeldPose& pose : poses) units[pose.unit].push_back(&pose);
  std::vector<std::vector<double>> distances(all.size());
  for (const auto& [unit, left_out] : units) {
    std::vector<PoseSums> rest = all;
    for (const HeldPose* pose : left_out) rest[pose->label].add(pose->angles_rad, -pose->weight);
    const Whitening learnt = whitening_of(rest);
    for (const HeldPose* pose : left_out) {
      if (learnt.mean[pose->label].size() == 0) continue;  // nobody else shows it
      distances[pose->label].push_back(learnt.distance(pose->label, pose->angles_rad));
    }
  }
  return distances;
}

// Of few values the second largest, because one gesture that was labelled wrongly would make the
// largest any number.
double share_below(std::vector<double> values, double share) {
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(at));
  return values[at];
}

int people_in(const std::vector<Recording>& recordings) {
  std::map<std::string, int> people;
  for (const Recording& recording : recordings) ++people[recording.person];
  return static_cast<int>(people.size());
}

// How far a held pose may lie from a recorded label's and still be that gesture, learnt from people
// who are left out of training one at a time (models/gesture/README.md, "None"). Cold. `recordings`
// have segments of each of `labels` that is trained, and of no other label.
HeldPoses held_poses(const std::vector<Recording>& recordings, const std::vector<Label>& labels) {
  std::map<std::string, std::size_t> recorded;
  for (const Label& label : labels) {
    if (label.trained) recorded.emplace(label.name, recorded.size());
  }
  HeldPoses held{.mean = {}, .whitening = {}, .limit = {}, .people = people_in(recordings)};
  auto poses = poses_of(recordings, recorded, held.people);
  if (held.people > 1) weigh(poses, recorded.size());
  const Index channels = recordings.front().angles_rad.cols();
  const std::vector<PoseSums> sums = sums_of(poses, recorded.size());
  const Whitening learnt = whitening_of(sums);
  const MatrixXd inverse = learnt.spread.matrixL().solve(MatrixXd::Identity(channels, channels));
  for (Index row = 0; row < channels; ++row) {
    for (Index c = 0; c <= row; ++c) held.whitening.push_back(inverse(row, c));
  }
  for (const VectorXd& mean : learnt.mean) held.mean.emplace_back(mean.begin(), mean.end());
  const auto distances = distances_left_out(poses, sums);
  std::vector<double> all;  // for a label that only one person shows
  for (const auto& of : distances) all.insert(all.end(), of.begin(), of.end());
  const double widened = held.people > 1 ? 1.0 : kWidened;
  for (const auto& of : distances) {
    const auto& shown = of.empty() ? all : of;
    // As many squared unit deviations as there are channels, where nothing was left out.
    const double limit = shown.empty() ? static_cast<double>(channels) : share_below(shown, kKept);
    // Poses that are the same to the bit have no spread to learn from.
    held.limit.push_back(widened * std::max(limit, kMinLimit * static_cast<double>(channels)));
  }
  return held;
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
