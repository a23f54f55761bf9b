#include "proto/clip/draft.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "proto/clip/figure.hpp"
#include "proto/clip/text.hpp"
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

// Bones keep their length, so the position channels of a joint below the root joint should be
// constant. Warns when one moves.
void settle_offsets(Clip& clip, Skeleton& skeleton) {
  const auto row = clip.channels.row(0);
  const std::span<const double> first(row.data(), static_cast<std::size_t>(row.size()));
  for (int j = skeleton.root_joint + 1; j < std::ssize(skeleton.joints); ++j) {
    Joint& joint = skeleton.joints[j];
    const Eigen::Vector3d offset_m = settled_offset(skeleton, j, first);
    for (int i = 0; i < 3; ++i) {
      if (std::abs(offset_m[i] - joint.offset_m[i]) > 0.1 * kSameLength_m) {
        joint.offset_m[i] = offset_m[i];
      }
    }
  }
  int warned = -1;
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    if (!channel.translation || channel.joint <= skeleton.root_joint) continue;
    if (channel.joint != warned && varies(clip.channels, c)) {
      warned = channel.joint;
      clip.warnings.push_back("joint " + in_quotes(skeleton.joints[channel.joint].name) +
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

// Brings a figure into metres and +Y up that is not, though its format is.
void settle_axes(const rig::Rig& rig, Clip& clip, Skeleton& skeleton) {
  const double metres = rig.metres_per_unit.value_or(1.0);
  if (metres == 1.0 && rig.up == UpAxis::kPlusY) return;
  for (Joint& joint : skeleton.joints) {
    joint.offset_m *= metres;
    if (joint.end_site_m) *joint.end_site_m *= metres;
  }
  const auto factors = turn_axes(up_turn(rig.up), skeleton);
  for (std::size_t c = 0; c < factors.size(); ++c) {
    const bool length = skeleton.channels[c].translation;
    clip.channels.col(static_cast<Eigen::Index>(c)) *= factors[c] * (length ? metres : 1.0);
  }
}

// What was taken otherwise than the format says and the user did not say.
void warn_of_axes(const rig::Rig& rig, const Draft& draft, Clip& clip) {
  if (!draft.said_unit_m && rig.metres_per_unit.value_or(1.0) != 1.0) {
    clip.warnings.push_back("its lengths cannot be metres; taken as " + rig.unit + " (" +
                            rig.why_unit + ")");
  }
  if (!draft.said_up && rig.up != UpAxis::kPlusY) {
    clip.warnings.push_back("does not stand along +y; taken as " + std::string(up_text(rig.up)) +
                            " up (" + rig.why_up + ")");
  }
}

// For formats that state their unit and have +Y up.
Result<> recognise_clip(Clip& clip, Skeleton& skeleton, const Draft& draft, const Hints& hints) {
  rig::RigInput known;
  known.T = hints.T;
  known.bones = draft.bones;
  known.T.resize(std::max(known.T.size(), draft.rests_in_t.size()));
  for (std::size_t j = 0; j < draft.rests_in_t.size(); ++j) {
    if (draft.rests_in_t[j] != 0) known.T[j] = Eigen::Quaterniond::Identity();
  }
  known.facing = draft.said_facing;
  known.up = draft.said_up;
  known.metres_per_unit = draft.said_unit_m;
  if (!known.up && !draft.up_may_err) known.up = UpAxis::kPlusY;
  if (!known.metres_per_unit && !draft.unit_may_err) known.metres_per_unit = 1.0;
  known.format_says = true;
  if (draft.profile != nullptr) TRY(add_profile(*draft.profile, skeleton, known));
  const auto picked = sample_frames(clip.frames(), static_cast<int>(skeleton.joints.size()));
  const ChannelMatrix sample = clip.channels(picked, Eigen::all);
  rig::Rig rig = recognise(skeleton, sample, std::move(known));
  apply(rig, skeleton);
  clip.warnings.insert(clip.warnings.end(), rig.notes.begin(), rig.notes.end());
  const std::size_t joints = skeleton.joints.size();
  const std::vector<char> stays = leave_out_joints(skeleton, rig);
  if (!stays.empty()) {
    std::vector<int> columns;
    for (std::size_t c = 0; c < stays.size(); ++c) {
      if (stays[c] != 0) columns.push_back(static_cast<int>(c));
    }
    clip.channels = ChannelMatrix(clip.channels(Eigen::all, columns));
    clip.warnings.push_back(left_out(joints, skeleton.joints.size()));
  }
  warn_of_axes(rig, draft, clip);
  settle_axes(rig, clip, skeleton);
  clip.rig = std::make_shared<const rig::Rig>(std::move(rig));
  return {};
}

// Sets bones, T frames, root joint and offsets.
Result<> complete(Clip& clip, Skeleton& skeleton, const Draft& draft, const Hints& hints) {
  if (!draft.rig) TRY(recognise_clip(clip, skeleton, draft, hints));
  for (std::size_t j = 0; j < std::min(hints.T.size(), skeleton.joints.size()); ++j) {
    if (hints.T[j]) skeleton.joints[j].T_world_joint = *hints.T[j];
  }
  const int hips = skeleton.joint_of(Bone::kHips);
  skeleton.root_joint = hints.root_joint ? *hints.root_joint
                        : hips >= 0      ? hips
                                         : find_root_joint(skeleton, clip.channels);
  settle_offsets(clip, skeleton);
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
  clip.up = draft.up;
  clip.rig = draft.rig;
  clip.warnings = std::move(draft.warnings);
  clip.time_s = std::move(draft.time_s);
  clip.timecode = std::move(draft.timecode);
  clip.channels = Eigen::Map<const ChannelMatrix>(
      draft.values.data(), static_cast<Eigen::Index>(draft.values.size() / channels),
      static_cast<Eigen::Index>(channels));
  assert(clip.time_s.empty() || std::ssize(clip.time_s) == clip.frames());
  auto skeleton = std::make_shared<Skeleton>(std::move(draft.skeleton));
  clip.skeleton = skeleton;
  TRY(check_values(clip));
  if (draft.skeleton_is_known) return clip;
  if (auto ok = complete(clip, *skeleton, draft, hints); !ok) {
    return fail(ok.error().message, name);
  }
  return clip;
}

}  // namespace posed::clip
