#include "proto/clip/hand_clip.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "proto/clip/format.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::clip {
namespace {

using JointsOfHand = std::array<int, kHandJoints>;  // joint index in the clip's skeleton

std::string_view side_name(Side side) { return side == Side::kLeft ? "left" : "right"; }

// The finger joints found on one side, and the first bone that is missing.
struct FoundHand {
  JointsOfHand joints{};
  std::optional<Bone> missing;
};

FoundHand find_hand(const Skeleton& skeleton, Side side) {
  FoundHand found;
  for (int j = 0; j < kHandJoints; ++j) {
    const Bone bone = hand_bone(side, j);
    found.joints[j] = skeleton.joint_of(bone);
    if (found.joints[j] < 0 && !found.missing) found.missing = bone;
  }
  return found;
}

Result<Side> side_of(const Clip& clip, const ReadOptions& options) {
  if (options.hand) return *options.hand;
  const bool left = !find_hand(*clip.skeleton, Side::kLeft).missing;
  const bool right = !find_hand(*clip.skeleton, Side::kRight).missing;
  if (left && right) return misuse("has two hands; say which with --hand left or right", clip.path);
  return left ? Side::kLeft : Side::kRight;
}

// The rotation of a joint of our hand when it has the same canonical pose as the clip's joint.
Eigen::Quaterniond ours(const Skeleton& theirs, int joint, const Skeleton& hand, int hand_joint,
                        const Eigen::Quaterniond& local) {
  const Eigen::Quaterniond canonical =
      T_above(theirs, joint) * local * theirs.joints[joint].T_world_joint.conjugate();
  return local_from_canonical(hand, hand_joint, canonical);
}

}  // namespace

Result<HandClip> hand_of(const Clip& clip, const ReadOptions& options) {
  const Skeleton& skeleton = *clip.skeleton;
  const auto side = TRY(side_of(clip, options));
  const FoundHand found = find_hand(skeleton, side);
  if (found.missing) {
    return fail("has no " + std::string(side_name(side)) + " hand with fifteen finger joints: " +
                    std::string(bone_name(*found.missing)) + " is missing",
                clip.path);
  }
  HandClip out{.path = clip.path,
               .side = side,
               .rate_hz = clip.frame_rate_hz,
               .time_s = clip.time_s,
               .angles = std::vector<HandAngles>(clip.frames()),
               .warnings = clip.warnings};
  for (int i = static_cast<int>(out.time_s.size()); i < clip.frames(); ++i) {
    out.time_s.push_back(i / clip.frame_rate_hz);
  }
  const bool is_ours = hand_side(skeleton) == side;
  const Skeleton hand = hand_skeleton(side);
  std::array<std::array<double, 3>, kHandJoints> near{};
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    HandAngles& angles = out.angles[i];
    if (is_ours) {
      for (std::size_t a = 0; a < angles.size(); ++a) {
        angles[a] = row[static_cast<Eigen::Index>(kChannelOfAngle[a])];
      }
      continue;
    }
    const std::span<const double> values(row.data(), row.size());
    for (std::size_t j = 0; j < kHandJoints; ++j) {
      const int joint = found.joints[j];
      const int target = static_cast<int>(j) + 1;
      const auto turned = channels_from_rotation(
          hand, target,
          ours(skeleton, joint, hand, target, local_rotation(skeleton, joint, values)), near[j]);
      for (std::size_t c = 0; c < 3; ++c) angles[kAngleOfChannel[3 * j + c]] = turned[c];
      // A frame that lacks the joint says nothing about the next one.
      if (std::ranges::all_of(turned, [](double angle) { return std::isfinite(angle); })) {
        near[j] = turned;
      }
    }
  }
  return out;
}

Result<HandClip> read_hand_clip(const std::filesystem::path& path, const ReadOptions& options) {
  ReadOptions accepted = options;  // of a body, `hand` says which of its hands is wanted
  if (!accepts(path, ReadOption::kHand)) accepted.hand.reset();
  const auto clip = TRY(read_clip(path, accepted));
  return hand_of(clip, options);
}

Result<Clip> clip_of_hand(const HandClip& hand, const std::string& hand_shape) {
  const auto shape = TRY(find_hand_shape(hand_shape));
  if (hand.angles.empty()) return fail("has no frames", hand.path);
  Clip clip{.path = hand.path,
            .skeleton = std::make_shared<Skeleton>(hand_skeleton(hand.side, *shape)),
            .frame_rate_hz = hand.rate_hz,
            .channels = ChannelMatrix(std::ssize(hand.angles), kHandChannels),
            .time_s = hand.time_s,
            .warnings = hand.warnings};
  for (std::size_t i = 0; i < hand.angles.size(); ++i) {
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      clip.channels(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) =
          hand.angles[i][kAngleOfChannel[c]];
    }
  }
  return clip;
}

void fill_gaps(HandClip& clip) {
  std::size_t filled = 0;
  const std::size_t frames = clip.angles.size();
  for (std::size_t c = 0; c < kHandChannels; ++c) {
    const auto known = [&](std::size_t i) { return std::isfinite(clip.angles[i][c]); };
    std::size_t before = frames;  // the last frame that has a value
    for (std::size_t i = 0; i <= frames; ++i) {
      if (i < frames && !known(i)) {
        ++filled;
        continue;
      }
      // Frames behind `before` and before `i` lack the value.
      for (std::size_t k = before == frames ? 0 : before + 1; k < i; ++k) {
        const double from = before < frames ? clip.angles[before][c] : 0.0;
        const double to = i < frames ? clip.angles[i][c] : from;
        const double start = before < frames ? from : to;
        const double share =
            before < frames && i < frames
                ? (clip.time_s[k] - clip.time_s[before]) / (clip.time_s[i] - clip.time_s[before])
                : 0.0;
        clip.angles[k][c] = start + share * (to - start);
      }
      before = i;
    }
  }
  if (filled > 0) {
    clip.warnings.push_back(std::to_string(filled) +
                            " missing values were filled from their neighbours in time");
  }
}

}  // namespace posed::clip
