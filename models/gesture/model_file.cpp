#include "models/gesture/model_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "models/gesture/vocabulary.hpp"
#include "posed/v1/model.pb.h"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/label.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/model/model_file.hpp"
#include "proto/model/validator.hpp"

namespace posed::gesture {
namespace {

using model_file::Validator;

constexpr int kMaxModelLabels = 1'000;

motion::PoseSpaceSpec read_joints(const v1::PoseSpace& from, Validator& check) {
  motion::PoseSpaceSpec body;
  body.space = motion::Space::kHumanoid;
  check.want(from.name() == motion::space_name(body.space), "the pose space, which is no body's");
  body.joints.assign(from.joint().begin(), from.joint().end());
  check.want(!body.joints.empty() && body.joints.size() <= kBones, "the number of joints");
  check.want(
      std::set<std::string>(body.joints.begin(), body.joints.end()).size() == body.joints.size(),
      "a joint, which stands twice");
  for (const std::string& joint : body.joints) {
    check.want(bone_from_name(joint).has_value(), "a joint, which is no bone of the humanoid");
  }
  check.want(from.root() < body.joints.size(), "the root joint");
  check.want(from.mean_xyzw_size() == 4 * from.joint_size(), "the number of mean rotations");
  for (int j = 0; j < from.joint_size() && check.valid(); ++j) {
    const auto at = [&](int i) { return from.mean_xyzw(4 * j + i); };
    body.mean.emplace_back(at(3), at(0), at(1), at(2));
    check.want(std::abs(body.mean.back().norm() - 1.0) < 1e-6, "a mean rotation's length");
  }
  body.root = static_cast<int>(from.root());
  return body;
}

std::vector<ChannelGroup> read_groups(const v1::GestureModel& from, Validator& check) {
  std::vector<ChannelGroup> groups;
  std::set<std::string> names;
  check.want(from.group_size() >= 1 && from.group_size() <= kMaxGroups, "the number of groups");
  int first = 0;
  for (const v1::GestureGroup& group : from.group()) {
    check.want(is_label_name(group.name()), "a group's name");
    check.want(names.insert(group.name()).second, "a group's name, which stands twice");
    check.want(group.joints() >= 1 && group.joints() <= kBones, "the number of a group's joints");
    check.want(group.classes() >= 1 && group.classes() <= kMaxClasses, "a group's classes");
    if (!check.valid()) return groups;
    const int channels = 3 * static_cast<int>(group.joints());
    groups.push_back({group.name(), first, channels, static_cast<int>(group.classes())});
    first += channels;
  }
  check.want(first == 3 * from.space().joint_size(), "the groups, which do not share the joints");
  return groups;
}

std::vector<Label> read_labels(const v1::GestureModel& from,
                               const std::vector<ChannelGroup>& groups, Validator& check) {
  const auto count = static_cast<int>(groups.size());
  std::vector<Label> labels;
  std::set<std::string> names;
  check.want(from.label_size() >= 1 && from.label_size() <= kMaxModelLabels,
             "the number of labels");
  if (!check.valid()) return labels;
  for (const v1::GestureLabel& label : from.label()) {
    Label read{.name = label.name(), .group_class = {}, .trained = label.trained()};
    check.want(is_label_name(read.name), "a label's name");
    check.want(names.insert(read.name).second, "a label's name, which stands twice");
    check.want(label.finger_class_size() == count, "a label's classes, not one a finger or group");
    for (int g = 0; g < count && check.valid(); ++g) {
      check.want(label.finger_class(g) < static_cast<unsigned>(groups[g].classes),
                 "a label's class");
      read.group_class.push_back(static_cast<int>(label.finger_class(g)));
    }
    if (label.shown_rad_size() > 0) {
      const int channels = groups.back().first + groups.back().channels;
      check.want(label.shown_rad_size() == channels, "the number of angles of a shown pose");
      check.numbers(label.shown_rad(), -kMaxAngle_rad, kMaxAngle_rad, "an angle of a shown pose");
      read.shown.assign(label.shown_rad().begin(), label.shown_rad().end());
    }
    labels.push_back(std::move(read));
  }
  return labels;
}

std::vector<int> read_named(const v1::GestureModel& from, Validator& check) {
  std::set<std::uint32_t> named;
  for (const std::uint32_t label : from.named()) {
    check.want(label < static_cast<unsigned>(from.label_size()), "a label that questions name");
    check.want(named.insert(label).second, "a label that questions name, which stands twice");
  }
  return {from.named().begin(), from.named().end()};
}

void write_body(const Vocabulary& vocabulary, v1::GestureModel& out) {
  const motion::PoseSpaceSpec& body = *vocabulary.body;
  v1::PoseSpace& space = *out.mutable_space();
  space.set_name(std::string(motion::space_name(body.space)));
  for (const std::string& joint : body.joints) space.add_joint(joint);
  for (const Eigen::Quaterniond& mean : body.mean) {
    for (const double value : {mean.x(), mean.y(), mean.z(), mean.w()}) space.add_mean_xyzw(value);
  }
  space.set_root(static_cast<std::uint32_t>(body.root));
  for (const ChannelGroup& group : vocabulary.groups) {
    v1::GestureGroup& part = *out.add_group();
    part.set_name(group.name);
    part.set_joints(static_cast<std::uint32_t>(group.channels / 3));
    part.set_classes(static_cast<std::uint32_t>(group.classes));
  }
}

// Reads the labels with their classes, and the joints and groups of a body (proto/README.md). What
// is wrong goes to `check`; `vocabulary` may be used only if that stays valid.
void read_vocabulary(const v1::GestureModel& from, Vocabulary& vocabulary, Validator& check) {
  if (from.has_space()) {
    vocabulary.body = read_joints(from.space(), check);
    vocabulary.groups = read_groups(from, check);
  } else {
    check.want(from.group_size() == 0, "the groups, which a hand does not have");
  }
  if (!check.valid()) return;
  vocabulary.labels = read_labels(from, vocabulary.groups, check);
  vocabulary.named = read_named(from, check);
  vocabulary.tells_none = from.tells_none();
}

void write_vocabulary(const Vocabulary& vocabulary, v1::GestureModel& out) {
  for (const Label& label : vocabulary.labels) {
    v1::GestureLabel& written = *out.add_label();
    written.set_name(label.name);
    for (const int group_class : label.group_class) {
      written.add_finger_class(static_cast<std::uint32_t>(group_class));
    }
    written.set_trained(label.trained);
    written.mutable_shown_rad()->Add(label.shown.begin(), label.shown.end());
  }
  if (vocabulary.body) write_body(vocabulary, out);
  for (const int label : vocabulary.named) out.add_named(static_cast<std::uint32_t>(label));
  if (vocabulary.tells_none) out.set_tells_none(true);
}

constexpr int kMaxTreeDepth = 12;           // more questions make no larger tree than these do
constexpr double kMaxTrainedFrames = 1e12;  // of training, all recordings together
// A thousandth of what training leaves at least for noise; far less would leave the solvers without
// digits.
constexpr double kMinDeviation = 1e-6;  // rad, or frames

// What the Gaussians of a tree may say, whose deviations are at most as large as their means.
struct GaussianRange {
  double low, high;
};
// The largest delta-delta of angles that are plausible themselves is four times as large as they.
constexpr GaussianRange kAngles{-4.0 * kMaxAngle_rad, 4.0 * kMaxAngle_rad};

// Copies the file's row, from `row` on, into a leaf's values.
void read_row(const double* row, int dims, std::array<std::vector<double>, kDeltaWindows>& to) {
  const int channels = dims / kDeltaWindows;
  for (int w = 0; w < kDeltaWindows; ++w) {
    to[w].assign(row + w * channels, row + (w + 1) * channels);
  }
}
void read_row(const double* row, int dims, std::array<double, kStates>& to) {
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
  const int most = 1 << std::min(questions, kMaxTreeDepth);
  check.want(count >= 1 && count < 2 * most, "the number of nodes of a tree");
  check.want(from.yes_size() == count && from.no_size() == count && from.leaf_size() == count,
             "the node arrays of a tree, which differ in length");
  if (!check.valid()) return;
  std::vector<int> parents(count);
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
  tree.leaves.resize(leaves);
}

template <typename Gaussian>
Tree<Gaussian> read_tree(const v1::GestureTree& from, const TreeShape& shape,
                         const GaussianRange& range, Validator& check) {
  Tree<Gaussian> tree;
  read_nodes(from, shape.questions, tree, check);
  if (!check.valid()) return {};
  const int leaves = static_cast<int>(tree.leaves.size());
  const int dims = shape.dims;
  check.want(from.mean_size() == leaves * dims && from.variance_size() == leaves * dims &&
                 from.occupancy_size() == leaves,
             "the number of a tree's means, variances or occupancies");
  check.numbers(from.mean(), range.low, range.high, "a mean");
  check.numbers(from.variance(), kMinDeviation * kMinDeviation, range.high * range.high,
                "a variance");
  check.numbers(from.occupancy(), 0.0, kMaxTrainedFrames, "an occupancy");
  if (!check.valid()) return {};
  for (int i = 0; i < leaves; ++i) {
    read_row(from.mean().data() + i * dims, dims, tree.leaves[i].mean);
    read_row(from.variance().data() + i * dims, dims, tree.leaves[i].variance);
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
    model.low.push_back(
        check.number(from.low_rad(c), -kMaxAngle_rad, kMaxAngle_rad, "the range of an angle"));
    model.high.push_back(
        check.number(from.high_rad(c), model.low.back(), kMaxAngle_rad, "the range of an angle"));
  }
}

// Rows of a lower triangle are found by its index alone, so its length must be right.
void read_held(const v1::GestureHeld& from, GestureModel& model, Validator& check) {
  constexpr double kMaxPeople = 1e6;
  const int channels = model.channels();
  const auto labels = static_cast<int>(std::ranges::count(model.labels, true, &Label::trained));
  check.want(model.is_hand(), "held poses, which only a hand's model has");
  check.want(from.mean_rad_size() == labels * channels && from.limit_size() == labels,
             "the number of held poses");
  check.want(from.whitening_size() == channels * (channels + 1) / 2,
             "the size of the held poses' spread");
  check.numbers(from.mean_rad(), -kMaxAngle_rad, kMaxAngle_rad, "an angle of a held pose");
  check.numbers(from.whitening(), -1.0 / kMinDeviation, 1.0 / kMinDeviation,
                "the held poses' spread");
  check.numbers(from.limit(), 1e-6, 1e12, "how far a held pose may be");
  const double people = check.number(from.people(), 1.0, kMaxPeople, "the number of people");
  if (!check.valid()) return;
  HeldPoses& held = model.held.emplace();
  for (int l = 0; l < labels; ++l) {
    const auto* const row = from.mean_rad().data() + l * channels;
    held.mean.emplace_back(row, row + channels);
  }
  held.whitening.assign(from.whitening().begin(), from.whitening().end());
  held.limit.assign(from.limit().begin(), from.limit().end());
  held.people = static_cast<int>(people);
}

void write_held(const HeldPoses& held, v1::GestureHeld& out) {
  for (const auto& mean : held.mean) out.mutable_mean_rad()->Add(mean.begin(), mean.end());
  out.mutable_whitening()->Add(held.whitening.begin(), held.whitening.end());
  out.mutable_limit()->Add(held.limit.begin(), held.limit.end());
  out.set_people(static_cast<std::uint32_t>(held.people));
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
    model.trees[i / groups].push_back(
        read_tree<GroupGaussian>(from.tree(i), shape, kAngles, check));
  }
  const TreeShape shape = shape_of(model, Vocabulary::kDurations);
  const GaussianRange frames{0.0, kMaxState_s * model.rate_hz};
  model.durations = read_tree<DurationGaussian>(from.duration(), shape, frames, check);
  read_range(from, model, check);
  if (from.has_held()) read_held(from.held(), model, check);
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
  const auto file = TRY(model_file::open(bytes, name));
  if (!file.has_gesture()) {
    return fail("the model is not a gesture model; make one with `posed train gesture`", name);
  }
  Validator check;
  GestureModel model = read_model(file.gesture(), check);
  TRY(check.verdict(name));
  return model;
}

Result<GestureModel> load_model(const std::filesystem::path& path) {
  const auto bytes = TRY(model_file::load(path));
  return parse_model(std::as_bytes(std::span(bytes)), path.string());
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
  if (model.held) write_held(*model.held, *gesture.mutable_held());
  gesture.set_report_json(model.report_json);
  return model_file::wrap(std::move(file));
}

Result<> save_model(const GestureModel& model, const std::filesystem::path& path) {
  return model_file::save(serialize_model(model), path);
}

}  // namespace posed::gesture
