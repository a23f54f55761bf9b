#include "models/gesture/model_file.hpp"

#include <set>
#include <utility>

#include "proto/frame/label.hpp"
#include "proto/model/model_file.hpp"
#include "proto/model/validator.hpp"

namespace posed::gesture {
namespace {

using model_file::kMaxNumber;
using model_file::Validator;

constexpr int kMaxModelLabels = 1'000;
constexpr int kMaxLeaves = 1 << kQuestions;  // because no path asks a question twice
constexpr double kMinVariance = 1e-20;       // its inverse can still be summed without overflow

constexpr int kRow = kDeltaWindows * kFingerChannels;

// A leaf's values in the order of the file's rows.
std::span<double> mean_row(FingerGaussian& leaf) { return {leaf.mean[0].data(), kRow}; }
std::span<double> variance_row(FingerGaussian& leaf) { return {leaf.variance[0].data(), kRow}; }
std::span<double> mean_row(DurationGaussian& leaf) { return leaf.mean; }
std::span<double> variance_row(DurationGaussian& leaf) { return leaf.variance; }
static_assert(sizeof(FingerGaussian::mean) == kRow * sizeof(double));

// Checks that the nodes form one tree: children come after their parent, so every descent ends;
// every node but the root is the child of exactly one node; every leaf Gaussian belongs to exactly
// one node.
template <typename Gaussian>
void read_nodes(const v1::GestureTree& from, Tree<Gaussian>& tree, Validator& check) {
  const int count = from.question_size();
  check.want(count >= 1 && count < 2 * kMaxLeaves, "the number of nodes of a tree");
  check.want(from.yes_size() == count && from.no_size() == count && from.leaf_size() == count,
             "the node arrays of a tree, which differ in length");
  if (!check.sound()) return;
  std::vector<int> parents(static_cast<std::size_t>(count));
  int leaves = 0;
  for (int i = 0; i < count && check.sound(); ++i) {
    const TreeNode node{from.question(i), from.yes(i), from.no(i), from.leaf(i)};
    const bool is_leaf = node.question < 0;
    if (is_leaf) {
      check.want(node.question == -1 && node.yes == -1 && node.no == -1 && node.leaf == leaves,
                 "a leaf of a tree");
      ++leaves;
    } else {
      check.want(node.question < kQuestions && node.leaf == -1, "a question of a tree");
      for (const int child : {node.yes, node.no}) {
        check.want(child > i && child < count, "a child of a tree's node");
        if (check.sound()) ++parents[child];
      }
    }
    tree.nodes.push_back(node);
  }
  for (int i = 1; i < count && check.sound(); ++i) {
    check.want(parents[i] == 1, "a tree's node, which is not the child of one node");
  }
  tree.leaves.resize(static_cast<std::size_t>(leaves));
}

template <typename Gaussian>
Tree<Gaussian> read_tree(const v1::GestureTree& from, Validator& check) {
  Tree<Gaussian> tree;
  read_nodes(from, tree, check);
  if (!check.sound()) return {};
  const int leaves = static_cast<int>(tree.leaves.size());
  Gaussian shape;
  const int dims = static_cast<int>(mean_row(shape).size());
  check.want(from.mean_size() == leaves * dims && from.variance_size() == leaves * dims &&
                 from.occupancy_size() == leaves,
             "the number of a tree's means, variances or occupancies");
  check.numbers(from.mean(), -kMaxNumber, kMaxNumber, "a mean");
  check.numbers(from.variance(), kMinVariance, kMaxNumber, "a variance");
  check.numbers(from.occupancy(), 0.0, kMaxNumber, "an occupancy");
  if (!check.sound()) return {};
  for (int i = 0; i < leaves; ++i) {
    std::copy_n(from.mean().begin() + i * dims, dims, mean_row(tree.leaves[i]).begin());
    std::copy_n(from.variance().begin() + i * dims, dims, variance_row(tree.leaves[i]).begin());
  }
  tree.occupancy.assign(from.occupancy().begin(), from.occupancy().end());
  return tree;
}

std::vector<Label> read_labels(const v1::GestureModel& from, Validator& check) {
  std::vector<Label> labels;
  std::set<std::string> names;
  check.want(from.label_size() >= 1 && from.label_size() <= kMaxModelLabels,
             "the number of labels");
  if (!check.sound()) return labels;
  for (const v1::GestureLabel& label : from.label()) {
    Label read{.name = label.name(), .trained = label.trained()};
    check.want(is_label_name(read.name), "a label's name");
    check.want(names.insert(read.name).second, "a label's name, which stands twice");
    check.want(label.finger_class_size() == kFingers, "a label's classes, not one a finger");
    for (int f = 0; f < kFingers && check.sound(); ++f) {
      check.want(label.finger_class(f) < kClasses, "a label's class");
      read.finger_class[f] = static_cast<int>(label.finger_class(f));
    }
    labels.push_back(std::move(read));
  }
  return labels;
}

void read_range(const v1::GestureModel& from, GestureModel& model, Validator& check) {
  check.want(from.low_rad_size() == kHandChannels && from.high_rad_size() == kHandChannels,
             "the range of the angles");
  if (!check.sound()) return;
  for (int c = 0; c < kHandChannels; ++c) {
    model.low[c] = check.number(from.low_rad(c), -1e3, 1e3, "the range of an angle");
    model.high[c] = check.number(from.high_rad(c), model.low[c], 1e3, "the range of an angle");
  }
}

GestureModel read_model(const v1::GestureModel& from, Validator& check) {
  GestureModel model;
  model.rate_hz = check.number(from.rate_hz(), 1.0, 10'000.0, "the frame rate");
  model.labels = read_labels(from, check);
  check.want(from.tree_size() == kStates * kFingers, "the number of trees");
  if (!check.sound()) return model;
  for (int i = 0; i < kStates * kFingers; ++i) {
    model.trees[i / kFingers][i % kFingers] = read_tree<FingerGaussian>(from.tree(i), check);
  }
  model.durations = read_tree<DurationGaussian>(from.duration(), check);
  read_range(from, model, check);
  model.report_json = from.report_json();
  return model;
}

template <typename Gaussian>
void write_tree(const Tree<Gaussian>& tree, v1::GestureTree& out) {
  for (const TreeNode& node : tree.nodes) {
    out.add_question(node.question);
    out.add_yes(node.yes);
    out.add_no(node.no);
    out.add_leaf(node.leaf);
  }
  for (Gaussian leaf : tree.leaves) {
    for (const double value : mean_row(leaf)) out.add_mean(value);
    for (const double value : variance_row(leaf)) out.add_variance(value);
  }
  out.mutable_occupancy()->Add(tree.occupancy.begin(), tree.occupancy.end());
}

}  // namespace

Result<GestureModel> parse_model(std::span<const std::byte> bytes, const std::string& name) {
  const auto file = model_file::open(bytes, name);
  if (!file) return std::unexpected(file.error());
  if (!file->has_gesture()) {
    return fail("the model is not a gesture model; make one with `posed train gesture`", name);
  }
  Validator check;
  GestureModel model = read_model(file->gesture(), check);
  if (auto verdict = check.verdict(name); !verdict) return std::unexpected(verdict.error());
  return model;
}

Result<GestureModel> load_model(const std::filesystem::path& path) {
  const auto bytes = model_file::load(path);
  if (!bytes) return std::unexpected(bytes.error());
  return parse_model(std::as_bytes(std::span(*bytes)), path.string());
}

std::string serialize_model(const GestureModel& model) {
  v1::ModelFile file;
  v1::GestureModel& gesture = *file.mutable_gesture();
  gesture.set_rate_hz(model.rate_hz);
  for (const Label& label : model.labels) {
    v1::GestureLabel& out = *gesture.add_label();
    out.set_name(label.name);
    for (const int finger_class : label.finger_class) {
      out.add_finger_class(static_cast<std::uint32_t>(finger_class));
    }
    out.set_trained(label.trained);
  }
  for (const auto& state : model.trees) {
    for (const auto& tree : state) write_tree(tree, *gesture.add_tree());
  }
  write_tree(model.durations, *gesture.mutable_duration());
  gesture.mutable_low_rad()->Add(model.low.begin(), model.low.end());
  gesture.mutable_high_rad()->Add(model.high.begin(), model.high.end());
  gesture.set_report_json(model.report_json);
  return model_file::wrap(std::move(file));
}

Result<> save_model(const GestureModel& model, const std::filesystem::path& path) {
  return model_file::save(serialize_model(model), path);
}

}  // namespace posed::gesture
