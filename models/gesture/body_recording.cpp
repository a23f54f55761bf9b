#include "models/gesture/body_recording.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "models/gesture/gesture_model.hpp"
#include "models/motion/motion.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/label.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

constexpr double kSamePose_rad = 15.0 * kDegree;  // rms over the joints

// The group that already has the joint.
const JointGroup* group_with(const std::vector<JointGroup>& groups, const std::string& joint) {
  for (const JointGroup& group : groups) {
    if (std::ranges::find(group.joints, joint) != group.joints.end()) return &group;
  }
  return nullptr;
}

Result<> check_group(const std::vector<JointGroup>& groups, const JointGroup& group) {
  if (!is_label_name(group.name)) {
    return fail(in_quotes(group.name) +
                " is no name of a group; use 1 to 15 signs of ASCII without a blank");
  }
  if (group.joints.empty()) {
    return fail("group " + in_quotes(group.name) +
                " has no joints; give it some: joints = [\"leftUpperArm\", \"leftLowerArm\"]");
  }
  for (const std::string& joint : group.joints) {
    if (!bone_from_name(joint)) {
      return fail("group " + in_quotes(group.name) + " has the joint " + in_quotes(joint) +
                  ", which is no bone of the humanoid; name joints as VRM does: leftUpperArm");
    }
    const JointGroup* const other = group_with(groups, joint);
    if (other != &group || std::ranges::count(group.joints, joint) > 1) {
      return fail("groups overlap: joint " + in_quotes(joint) + " is in " + in_quotes(other->name) +
                  " and again in " + in_quotes(group.name) + "; a joint is in one group");
    }
  }
  return {};
}

// The clip's motion at `rate_hz`, if its skeleton has the vocabulary's joints.
Result<motion::Motion> motion_at(const clip::Clip& clip, double rate_hz,
                                 const Vocabulary& vocabulary) {
  for (const std::string& joint : vocabulary.body->joints) {
    if (clip.skeleton->joint_of(*bone_from_name(joint)) >= 0) continue;
    return fail("the skeleton has no " + clean_name(joint) +
                    ", which the other clips or the questions file have; use clips of skeletons "
                    "that have it, or groups without it",
                clip.path);
  }
  auto motion = TRY(motion::performed_motion_of(clip));
  if (motion.size() < kStates) {
    return fail("the recording has " + std::to_string(motion.size()) +
                    " frames; a gesture alone needs " + std::to_string(kStates),
                clip.path);
  }
  return motion::resample(motion, rate_hz);
}

// The motion's rotation vectors.
Result<Recording> recording_of(const motion::Motion& motion, const Vocabulary& vocabulary,
                               const std::string& file) {
  const auto space = TRY(motion::PoseSpace::bind(*vocabulary.body, *motion.skeleton));
  Recording recording{.file = file, .rate_hz = motion.rate_hz, .angles_rad = {}, .segments = {}};
  recording.angles_rad = motion::pose_vectors(motion, space, motion::walk_heading_rad(motion));
  const FeatureMatrix& q = recording.angles_rad;
  const double apart_rad = (q.bottomRows<1>() - q.topRows<1>()).norm();
  recording.closed = apart_rad <= kSamePose_rad * std::sqrt(static_cast<double>(q.cols()) / 3.0);
  for (Eigen::Index t = 1; t < q.rows(); ++t) {
    for (int c = 0; c < space.dims(); ++c) {
      if (std::abs(q(t, c) - q(t - 1, c)) <= std::numbers::pi) continue;
      const std::size_t joint = space.joint_of_dim(c);
      return fail("joint " + vocabulary.body->joints[joint] + " turns over between the frames " +
                      std::to_string(t) + " and " + std::to_string(t + 1) +
                      ", so it cannot be learnt from; leave the clip out",
                  file);
    }
  }
  return recording;
}

}  // namespace

const std::vector<JointGroup>& body_groups() {
  static const std::vector<JointGroup> groups{
      {"head", {"neck", "head"}},
      {"left-arm", {"leftShoulder", "leftUpperArm", "leftLowerArm", "leftHand"}},
      {"legs",
       {"hips", "leftUpperLeg", "leftLowerLeg", "leftFoot", "leftToes", "rightUpperLeg",
        "rightLowerLeg", "rightFoot", "rightToes"}},
      {"right-arm", {"rightShoulder", "rightUpperArm", "rightLowerArm", "rightHand"}},
      {"trunk", {"spine", "chest", "upperChest"}}};
  return groups;
}

std::vector<JointGroup> body_groups(const Skeleton& skeleton) {
  std::vector<JointGroup> groups;
  for (JointGroup group : body_groups()) {
    std::erase_if(group.joints, [&](const std::string& joint) {
      const std::optional<Bone> bone = bone_from_name(joint);
      return !bone || skeleton.joint_of(*bone) < 0;
    });
    if (!group.joints.empty()) groups.push_back(std::move(group));
  }
  return groups;
}

Result<Vocabulary> body_vocabulary(const std::vector<JointGroup>& groups) {
  if (groups.empty() || groups.size() > kMaxGroups) {
    return fail("a body has 1 to " + std::to_string(kMaxGroups) + " groups of joints, not " +
                std::to_string(groups.size()));
  }
  Vocabulary vocabulary;
  vocabulary.groups.clear();
  motion::PoseSpaceSpec& body = vocabulary.body.emplace();
  body.space = motion::Space::kHumanoid;
  int first = 0;
  for (const JointGroup& group : groups) {
    TRY(check_group(groups, group));
    const auto channels = 3 * static_cast<int>(group.joints.size());
    vocabulary.groups.push_back({group.name, first, channels, 1});
    first += channels;
    body.joints.insert(body.joints.end(), group.joints.begin(), group.joints.end());
  }
  const auto hips = std::ranges::find(body.joints, bone_name(Bone::kHips));
  if (hips == body.joints.end()) {
    return fail("no group has the joint hips, from which the others are seen; add it to one");
  }
  body.root = static_cast<int>(hips - body.joints.begin());
  body.mean.assign(body.joints.size(), Eigen::Quaterniond::Identity());
  return vocabulary;
}

Result<std::vector<Recording>> body_recordings(const std::vector<clip::Clip>& clips, double rate_hz,
                                               Vocabulary& vocabulary) {
  std::vector<motion::Motion> motions;
  std::vector<const motion::Motion*> all;
  for (const clip::Clip& clip : clips) {
    auto motion = TRY(motion_at(clip, rate_hz, vocabulary));
    motions.push_back(std::move(motion));
  }
  all.reserve(motions.size());
  for (const motion::Motion& motion : motions) all.push_back(&motion);
  TRY(motion::set_mean_rotations(all, *vocabulary.body));
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    auto recording = TRY(recording_of(motions[i], vocabulary, clips[i].path));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

Result<Recording> body_recording(const clip::Clip& clip, double rate_hz,
                                 const Vocabulary& vocabulary) {
  const auto motion = TRY(motion_at(clip, rate_hz, vocabulary));
  return recording_of(motion, vocabulary, clip.path);
}

}  // namespace posed::gesture
