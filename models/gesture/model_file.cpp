#include "models/gesture/model_file.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "models/gesture/vocabulary_file.hpp"
#include "proto/model/model_file.hpp"
#include "proto/model/validator.hpp"

namespace posed::gesture {
namespace {

using model_file::kMaxNumber;
using model_file::Validator;

constexpr int kMostDeep = 12;           // more questions make no larger tree than these do
constexpr double kMinVariance = 1e-20;  // its inverse can still be summed without overflow

// Copies the file's row, from `row` on, into a leaf's values.
void take_row(const double* row, int dims, std::array<std::vector<double>, kDeltaWindows>& to) {
  const int channels = dims / kDeltaWindows;
  for (int w = 0; w < kDeltaWindows; ++w) {
    to[w].assign(row + w * channels, row + (w + 1) * channels);
  }
}
void take_row(const double* row, int dims, std::array<double, kStates>& to) {
  std::copy_n(row, dims, to.begin());
}

void add_row(const std::array<std::vector<double>, kDeltaWindows>& from,
             google::protobuf::RepeatedField<double>& to) {
  for (const auto& window : from) to.Add(window.begin(), window.end());
}
void add_row(const std::array<double, kStates>& from, google::protobuf::RepeatedField<double>& to) {
  to.Add(from.begin(), from.end());
}

// What a tree must have: its questions are below this number, and a leaf has `dims` values.
struct TreeShape {
  int questions, dims;
};
TreeShape shape_of(const Vocabulary& vocabulary, int group) {
  const int dims =
      group == Vocabulary::kDurations ? kStates : kDeltaWindows * vocabulary.groups[group].channels;
  return {3 * vocabulary.statements(group), dims};
}

// Checks that the nodes form one tree: children come after their parent, so every descent ends;
// every node but the root is the child of exactly one node; every leaf Gaussian belongs to exactly
// one node.
template <typename Gaussian>
void read_nodes(const v1::GestureTree& from, int questions, Tree<Gaussian>& tree,
                Validator& check) {
  const int count = from.question_size();
  // No path asks a question twice.
  const int most = 1 << std::min(questions, kMostDeep);
  check.want(count >= 1 && count < 2 * most, "the number of nodes of a tree");
  check.want(from.yes_size() == count && from.no_size() == count && from.leaf_size() == count,
             "the node arrays of a tree, which differ in length");
  if (!check.valid()) return;
  std::vector<int> parents(static_cast<std::size_t>(count));
  int leaves = 0;
  for (int i = 0; i < count && check.valid(); ++i) {
    const TreeNode node{from.question(i), from.yes(i), from.no(i), from.leaf(i)};
    const bool is_leaf = node.question < 0;
    if (is_leaf) {
      check.want(node.question == -1 && node.yes == -1 && node.no == -1 && node.leaf == leaves,
                 "a leaf of a tree");
      ++leaves;
    } else {
      check.want(node.question < questions && node.leaf == -1, "a question of a tree");
      for (const int child : {node.yes, node.no}) {
        check.want(child > i && child < count, "a child of a tree's node");
        if (check.valid()) ++parents[child];
      }
    }
    tree.nodes.push_back(node);
  }
  for (int i = 1; i < count && check.valid(); ++i) {
    check.want(parents[i] == 1, "a tree's node, which is not the child of one node");
  }
  tree.leaves.resize(static_cast<std::size_t>(leaves));
}

template <typename Gaussian>
Tree<Gaussian> read_tree(const v1::GestureTree& from, const TreeShape& shape, Validator& check) {
  Tree<Gaussian> tree;
  read_nodes(from, shape.questions, tree, check);
  if (!check.valid()) return {};
  const int leaves = static_cast<int>(tree.leaves.size());
  const int dims = shape.dims;
  check.want(from.mean_size() == leaves * dims && from.variance_size() == leaves * dims &&
                 from.occupancy_size() == leaves,
             "the number of a tree's means, variances or occupancies");
  check.numbers(from.mean(), -kMaxNumber, kMaxNumber, "a mean");
  check.numbers(from.variance(), kMinVariance, kMaxNumber, "a variance");
  check.numbers(from.occupancy(), 0.0, kMaxNumber, "an occupancy");
  if (!check.valid()) return {};
  for (int i = 0; i < leaves; ++i) {
    take_row(from.mean().data() + i * dims, dims, tree.leaves[i].mean);
    take_row(from.variance().data() + i * dims, dims, tree.leaves[i].variance);
  }
  tree.occupancy.assign(from.occupancy().begin(), from.occupancy().end());
  return tree;
}

void read_range(const v1::GestureModel& from, GestureModel& model, Validator& check) {
  const int channels = model.channels();
  check.want(from.low_rad_size() == channels && from.high_rad_size() == channels,
             "the range of the angles");
  if (!check.valid()) return;
  for (int c = 0; c < channels; ++c) {
    model.low.push_back(check.number(from.low_rad(c), -1e3, 1e3, "the range of an angle"));
    model.high.push_back(
        check.number(from.high_rad(c), model.low.back(), 1e3, "the range of an angle"));
  }
}

GestureModel read_model(const v1::GestureModel& from, Validator& check) {
  GestureModel model;
  model.rate_hz = check.number(from.rate_hz(), 1.0, 10'000.0, "the frame rate");
  read_vocabulary(from, model, check);
  if (!check.valid()) return model;
  const auto groups = static_cast<int>(model.groups.size());
  check.want(from.tree_size() == kStates * groups, "the number of trees");
  if (!check.valid()) return model;
  for (int i = 0; i < kStates * groups; ++i) {
    const TreeShape shape = shape_of(model, i % groups);
    model.trees[i / groups].push_back(read_tree<GroupGaussian>(from.tree(i), shape, check));
  }
  const TreeShape shape = shape_of(model, Vocabulary::kDurations);
  model.durations = read_tree<DurationGaussian>(from.duration(), shape, check);
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
  for (const Gaussian& leaf : tree.leaves) {
    add_row(leaf.mean, *out.mutable_mean());
    add_row(leaf.variance, *out.mutable_variance());
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
  write_vocabulary(model, gesture);
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
