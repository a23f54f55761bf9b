#include "proto/clip/draft.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "proto/clip/text.hpp"
#include "proto/frame/bone_names.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr double kSameLength_m = 0.001;

bool varies(const ChannelMatrix& channels, std::size_t c) {
  const auto column = channels.col(static_cast<Eigen::Index>(c));
  return column.maxCoeff() - column.minCoeff() > kSameLength_m;
}

// Finds the joint whose position moves the figure: the first from the root that moves in the clip.
int find_root_joint(const Skeleton& skeleton, const ChannelMatrix& channels) {
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    if (skeleton.channels[c].translation && varies(channels, c)) return skeleton.channels[c].joint;
  }
  return 0;
}

// Position channels of a joint below the root joint replace its OFFSET. Bones keep their length, so
// these channels should be constant; their value becomes the offset. Warns when one moves.
void settle_offsets(Clip& clip, Skeleton& skeleton) {
  int warned = -1;
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    if (!channel.translation || channel.joint <= skeleton.root_joint) continue;
    Joint& joint = skeleton.joints[channel.joint];
    const double first_m = clip.channels(0, static_cast<Eigen::Index>(c));
    double& offset_m = joint.offset_m[static_cast<int>(channel.axis)];
    if (std::abs(first_m - offset_m) > 0.1 * kSameLength_m) offset_m = first_m;
    if (channel.joint != warned && varies(clip.channels, c)) {
      warned = channel.joint;
      clip.warnings.push_back("joint " + in_quotes(joint.name) +
                              " changes its distance from its parent; posed keeps that of the "
                              "first frame");
    }
  }
}

// Refuses values that no pose can have. A reader of text has refused them before, with their line.
Result<> check_values(const Clip& clip) {
  for (int i = 0; i < clip.frames(); ++i) {
    for (std::size_t c = 0; c < clip.skeleton->channels.size(); ++c) {
      const Channel& channel = clip.skeleton->channels[c];
      const double value = clip.channels(i, static_cast<Eigen::Index>(c));
      const double max = channel.translation ? kMaxPosition_m : kMaxAngle_rad;
      if (!(std::abs(value) > max)) continue;  // a missing value is NaN
      return fail("frame " + std::to_string(i + 1) + ": joint " +
                      in_quotes(clip.skeleton->joints[channel.joint].name) +
                      " has a value beyond what a pose can have; is the unit right?",
                  clip.path);
    }
  }
  return {};
}

// Sets bones, root joint, offsets and T frames in this order, because each step needs the one
// before.
Result<> complete(Clip& clip, Skeleton& skeleton, const Profile* profile, const Hints& hints) {
  if (profile == nullptr) {
    name_bones(skeleton);
  } else {
    TRY(name_bones(*profile, skeleton));
  }
  const int hips = skeleton.joint_of(Bone::kHips);
  skeleton.root_joint = hints.root_joint ? *hints.root_joint
                        : hips >= 0      ? hips
                                         : find_root_joint(skeleton, clip.channels);
  settle_offsets(clip, skeleton);
  if (profile != nullptr) {
    set_t_frames(skeleton, known_t(*profile, skeleton));
  } else if (zero_pose_is_t(skeleton)) {
    set_t_frames(skeleton);
  } else if (!hints.T.empty()) {
    set_t_frames(skeleton, hints.T);
  } else {
    set_t_frames(skeleton, t_frames_from_mean_pose(skeleton, mean_rotations(clip)));
    clip.warnings.emplace_back(
        "the zero pose is no T-pose and no skeleton profile fits; the T-pose is taken from the "
        "mean pose of the clip, which should walk or stand");
  }
  const auto far = std::ranges::find_if(skeleton.joints, [](const Joint& joint) {
    return !(joint.offset_m.norm() <= kMaxPosition_m) ||
           (joint.end_site_m && !(joint.end_site_m->norm() <= kMaxPosition_m));
  });
  if (far != skeleton.joints.end()) {
    return fail("joint " + in_quotes(far->name) +
                " lies more than 1 km from its parent; is the unit of length right?");
  }
  return skeleton.finish();
}

// The line from the right to the left upper leg in the hips' frame; zero when either is unknown.
Eigen::Vector3d hip_line(const Skeleton& skeleton) {
  const int left = skeleton.joint_of(Bone::kLeftUpperLeg);
  const int right = skeleton.joint_of(Bone::kRightUpperLeg);
  if (left < 0 || right < 0) return Eigen::Vector3d::Zero();
  return skeleton.joints[left].offset_m - skeleton.joints[right].offset_m;
}

}  // namespace

// The memory grows with the frames actually read, not with the count in a header.
Result<> read_frames(const TextFrames& text, const std::string& name, std::vector<double>& values,
                     std::vector<double>& time_s) {
  std::vector<double> row(text.parser.channels());
  std::optional<std::int64_t> before;
  for (std::size_t i = 0; i < text.frames.size(); ++i) {
    const FrameSpan& span = text.frames[i];
    const FrameOutcome outcome = text.parser.parse(span.text, row);
    if (!outcome.ok()) {
      const auto lines = std::ranges::count(span.text.substr(0, outcome.offset), '\n');
      return fail("frame " + std::to_string(i + 1) + ": " + outcome.sentence(), name,
                  span.line + static_cast<int>(lines));
    }
    if (text.parser.numbered() && before && outcome.number != *before + 1) {
      return fail("frame " + std::to_string(outcome.number) + " follows frame " +
                      std::to_string(*before) + "; frames are missing or out of order",
                  name, span.line);
    }
    before = outcome.number;
    if (text.parser.timed()) time_s.push_back(outcome.time_s);
    values.insert(values.end(), row.begin(), row.end());
  }
  return {};
}

Result<Clip> clip_of(Draft draft, const std::string& name, const Hints& hints) {
  if (draft.values.empty()) return fail("has no frames, so there is nothing to play", name);
  const std::size_t channels = draft.skeleton.channels.size();
  assert(draft.values.size() % channels == 0);
  Clip clip;
  clip.path = name;
  clip.frame_rate_hz = draft.frame_rate_hz;
  clip.metres_per_unit = draft.metres_per_unit;
  clip.warnings = std::move(draft.warnings);
  clip.time_s = std::move(draft.time_s);
  clip.channels = Eigen::Map<const ChannelMatrix>(
      draft.values.data(), static_cast<Eigen::Index>(draft.values.size() / channels),
      static_cast<Eigen::Index>(channels));
  assert(clip.time_s.empty() || std::ssize(clip.time_s) == clip.frames());
  auto skeleton = std::make_shared<Skeleton>(std::move(draft.skeleton));
  clip.skeleton = skeleton;
  TRY(check_values(clip));
  if (draft.skeleton_is_known) return clip;
  if (auto ok = complete(clip, *skeleton, draft.profile, hints); !ok) {
    return fail(ok.error().message, name);
  }
  return clip;
}

std::vector<Eigen::Quaterniond> mean_rotations(const Clip& clip) {
  const Skeleton& skeleton = *clip.skeleton;
  const Eigen::Vector3d line = hip_line(skeleton);
  const int hips = std::max(skeleton.joint_of(Bone::kHips), 0);
  std::vector<Eigen::Quaterniond> global(skeleton.joints.size());
  std::vector<Eigen::Vector4d> sum(skeleton.joints.size(), Eigen::Vector4d::Zero());
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    const std::span<const double> values(row.data(), row.size());
    for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
      const int parent = skeleton.joints[j].parent;
      const Eigen::Quaterniond local = local_rotation(skeleton, j, values);
      global[j] = parent < 0 ? local : global[parent] * local;
    }
    // Left is +X when the figure faces +Z.
    const Eigen::Vector3d left = global[hips] * line;
    const Eigen::Quaterniond back = axis_rotation(Axis::kY, std::atan2(left.z(), left.x()));
    for (std::size_t j = 0; j < global.size(); ++j) {
      const Eigen::Vector4d q = (back * global[j]).coeffs();
      sum[j] += q.dot(sum[j]) < 0 ? Eigen::Vector4d(-q) : q;
    }
  }
  for (std::size_t j = 0; j < global.size(); ++j) {
    global[j] = sum[j].norm() > 1e-9 ? Eigen::Quaterniond(sum[j].normalized())
                                     : Eigen::Quaterniond::Identity();
  }
  return global;
}

}  // namespace posed::clip
