#include "models/gesture/train_report.hpp"
#include "models/gesture/movement_label.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"
#include "proto/text/list.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include <nlohmann/json.hpp>

namespace posed::gesture {
namespace {

using nlohmann::json;

constexpr int kFewGestures =
    20;  // with fewer, unseen labels get wrong poses (models/gesture/README.md, measured figures)
constexpr int kFewExamples = 2;
constexpr std::array<int, 2> kHold{2, 3};      // the states in which a gesture's pose is held
constexpr double kAlike_rad = 10.0 * kDegree;  // poses closer than this count as the same

using Counts = std::array<std::vector<int>, kStates>;  // [state][group]

int total(const Counts& counts) {
  int sum = 0;
  for (const auto& state : counts) {
    for (const int count : state) sum += count;
  }
  return sum;
}

json by_state(const Counts& counts, const std::vector<ChannelGroup>& groups) {
  json states = json::array();
  for (int state = 0; state < kStates; ++state) {
    json row{{"state", state + 1}};
    for (std::size_t g = 0; g < groups.size(); ++g) row[groups[g].name] = counts[state][g];
    states.push_back(std::move(row));
  }
  return states;
}

std::string classes_text(const Label& label) {
  std::string text;
  for (const int group_class : label.group_class) text += static_cast<char>('A' + group_class);
  return text;
}

}  // namespace

TrainReport::TrainReport(const std::vector<Recording>& recordings, const ContextModels& contexts,
                         const Vocabulary& vocabulary)
    : recordings_(recordings),
      contexts_(contexts),
      vocabulary_(vocabulary),
      astray_(vocabulary.groups.size()) {
  leaves_.fill(std::vector<int>(vocabulary.groups.size()));
  mixed_ = leaves_;
}

// The distance between the classes of a leaf's members in the channel where they differ most [rad].
double TrainReport::apart_rad(int state, int group, const std::vector<int>& members) const {
  const ChannelGroup& channels = vocabulary_.groups[group];
  struct Sum {
    Eigen::VectorXd angles;
    double frames = 0.0;
  };
  std::vector<Sum> classes(channels.classes, Sum{Eigen::VectorXd::Zero(channels.channels)});
  for (const int row : members) {
    const Statistics& sums = contexts_.sums[row];
    const Label& label = vocabulary_.labels[contexts_.contexts[row].current];
    Sum& of = classes[label.group_class[group]];
    of.angles += sums.first.row(state).segment(channels.first, channels.channels);
    of.frames += sums.occupancy[state];
  }
  double apart = 0.0;
  for (const Sum& a : classes) {
    for (const Sum& b : classes) {
      if (a.frames == 0.0 || b.frames == 0.0) continue;
      const Eigen::VectorXd difference = a.angles / a.frames - b.angles / b.frames;
      apart = std::max(apart, difference.cwiseAbs().maxCoeff());
    }
  }
  return apart;
}

void TrainReport::add_tree(int state, int group, const GrownTree& tree) {
  leaves_[state][group] = static_cast<int>(tree.members.size());
  const bool held = std::ranges::count(kHold, state) > 0;
  for (const auto& members : tree.members) {
    std::set<int> classes;
    for (const int row : members) {
      const Label& label = vocabulary_.labels[contexts_.contexts[row].current];
      classes.insert(label.group_class[group]);
    }
    if (classes.size() < 2) continue;
    ++mixed_[state][group];
    if (held && apart_rad(state, group, members) > kAlike_rad) ++astray_[group];
  }
}

int TrainReport::gestures_of(const std::string& label) const {
  int count = 0;
  for (const Recording& recording : recordings_) {
    count += static_cast<int>(std::ranges::count(recording.segments, label, &Segment::label));
  }
  return count;
}

// Whether most segments of a label swing once they have arrived.
bool TrainReport::swings(const std::string& label) const {
  int swinging = 0;
  for (const Recording& recording : recordings_) {
    for (const Segment& segment : recording.segments) {
      if (segment.label != label) continue;
      const int arrived = segment.begin + segment.frames() / 4;
      swinging += oscillation_in(recording, arrived, held_part(segment).end).steady ? 1 : 0;
    }
  }
  return 2 * swinging > gestures_of(label);
}

std::vector<std::string> TrainReport::warnings() const {
  std::vector<std::string> warnings;
  std::size_t gestures = 0;
  for (const Recording& recording : recordings_) gestures += recording.segments.size();
  if (gestures < kFewGestures) {
    warnings.push_back("only " + std::to_string(gestures) +
                       " gestures; below 20 labels that were not recorded go astray, record more");
  }
  for (const Label& label : vocabulary_.labels) {
    if (label.trained && gestures_of(label.name) < kFewExamples) {
      warnings.push_back("label " + in_quotes(label.name) +
                         " was recorded once only; how it varies is a guess");
    }
  }
  for (const Label& label : vocabulary_.labels) {
    if (vocabulary_.is_hand() || !swings(label.name)) continue;
    warnings.push_back("label " + in_quotes(label.name) +
                       " swings where its pose should be held, and the model performs the mean of "
                       "the swings; cut its takes with --auto-label --cycles");
  }
  if (const std::string mixed = mixed_warning(); !mixed.empty()) warnings.push_back(mixed);
  return warnings;
}

// A leaf of the hold that mixes classes gives a label that was not recorded the mean of two poses.
std::string TrainReport::mixed_warning() const {
  std::string parts;
  int leaves = 0;
  for (std::size_t g = 0; g < astray_.size(); ++g) {
    leaves += astray_[g];
    if (astray_[g] > 0) add_word(parts, vocabulary_.groups[g].name);
  }
  if (leaves == 0) return {};
  return std::to_string(leaves) +
         (leaves == 1 ? " leaf of the hold mixes" : " leaves of the hold mix") +
         " gestures whose " + (vocabulary_.is_hand() ? "finger" : "group of joints") +
         " is of different classes and poses (" + parts +
         "): a label that was not recorded may go astray there, record more";
}

TrainFindings TrainReport::findings() const {
  const std::size_t moving = std::ranges::count(contexts_.moves, true);
  return {contexts_.contexts.size(), moving, warnings()};
}

std::string TrainReport::json_of(const GestureModel& model) const {
  json report{{"rate_hz", model.rate_hz}, {"recordings", json::array()}};
  int frames = 0;
  int gestures = 0;
  for (const Recording& recording : recordings_) {
    const auto count = static_cast<int>(recording.segments.size());
    report["recordings"].push_back({{"file", std::filesystem::path(recording.file).filename()},
                                    {"frames", recording.angles_rad.rows()},
                                    {"gestures", count}});
    frames += static_cast<int>(recording.angles_rad.rows());
    gestures += count;
  }
  report["frames"] = frames;
  report["gestures"] = gestures;
  report["contexts"] = contexts_.contexts.size();
  report["moving_channels"] = std::ranges::count(contexts_.moves, true);
  report["labels"] = json::array();
  for (const Label& label : vocabulary_.labels) {
    report["labels"].push_back({{"name", label.name},
                                {"classes", classes_text(label)},
                                {"gestures", gestures_of(label.name)}});
  }
  report["leaves"] = total(leaves_);
  report["leaves_by_state"] = by_state(leaves_, vocabulary_.groups);
  report["mixed_leaves"] = total(mixed_);
  report["duration_leaves"] = model.durations.leaves.size();
  report["log_likelihood_per_frame"] = contexts_.log_likelihood / frames;
  report["warnings"] = warnings();
  return json_text(report);
}

}  // namespace posed::gesture
