#include "models/gesture/vocabulary_file.hpp"

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/label.hpp"

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
  for (int j = 0; j < from.joint_size() && check.sound(); ++j) {
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
    if (!check.sound()) return groups;
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
  if (!check.sound()) return labels;
  for (const v1::GestureLabel& label : from.label()) {
    Label read{.name = label.name(), .group_class = {}, .trained = label.trained()};
    check.want(is_label_name(read.name), "a label's name");
    check.want(names.insert(read.name).second, "a label's name, which stands twice");
    check.want(label.finger_class_size() == count, "a label's classes, not one a finger or group");
    for (int g = 0; g < count && check.sound(); ++g) {
      check.want(label.finger_class(g) < static_cast<unsigned>(groups[g].classes),
                 "a label's class");
      read.group_class.push_back(static_cast<int>(label.finger_class(g)));
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

}  // namespace

void read_vocabulary(const v1::GestureModel& from, Vocabulary& vocabulary, Validator& check) {
  if (from.has_space()) {
    vocabulary.body = read_joints(from.space(), check);
    vocabulary.groups = read_groups(from, check);
  } else {
    check.want(from.group_size() == 0, "the groups, which a hand does not have");
  }
  if (!check.sound()) return;
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
  }
  if (vocabulary.body) write_body(vocabulary, out);
  for (const int label : vocabulary.named) out.add_named(static_cast<std::uint32_t>(label));
  if (vocabulary.tells_none) out.set_tells_none(true);
}

}  // namespace posed::gesture
