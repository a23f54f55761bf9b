#include "proto/clip/mirror.hpp"

#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/clip/frames_clip.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr int kNoPartner = -1;

// The bone of the other side; the same one in the middle.
Bone other_side(Bone bone) {
  const std::string_view name = bone_name(bone);
  for (const auto& [from, to] : {std::pair{"left", "right"}, std::pair{"right", "left"}}) {
    if (!name.starts_with(from)) continue;
    return *bone_from_name(std::string(to).append(name.substr(std::strlen(from))));
  }
  return bone;
}

// Where the joints are in T-pose, from the first one [m].
std::vector<Eigen::Vector3d> T_places_m(const Skeleton& skeleton) {
  std::vector<Eigen::Vector3d> places_m;
  for (const Joint& joint : skeleton.joints) {
    const int above = joint.parent;
    places_m.emplace_back(Eigen::Vector3d::Zero());
    if (above < 0) continue;
    places_m.back() =
        places_m[above] + skeleton.joints[above].T_world_joint * joint.offset_m.cast<double>();
  }
  return places_m;
}

// Which joint has the place of each on the other side; kNoPartner: there is none. Bones by what
// they are, those between bones with them, and what hangs below by its place.
std::vector<int> partners_of(const Skeleton& skeleton) {
  const auto& joints = skeleton.joints;
  std::vector<int> partners(joints.size(), kNoPartner);
  const auto is_free = [&](int j) {
    return j >= 0 && !joints[j].bone && partners[j] == kNoPartner;
  };
  for (int j = 0; j < std::ssize(joints); ++j) {
    if (!joints[j].bone) continue;
    partners[j] = skeleton.joint_of(other_side(*joints[j].bone));
    if (partners[j] < 0) continue;
    int a = joints[j].parent, b = joints[partners[j]].parent;
    for (; is_free(a) && is_free(b); a = joints[a].parent, b = joints[b].parent) {
      partners[a] = b;
      partners[b] = a;
    }
  }
  const auto places_m = T_places_m(skeleton);
  for (int j = 0; j < std::ssize(joints); ++j) {
    if (!is_free(j)) continue;
    const int parent = joints[j].parent;
    if (parent < 0) partners[j] = j;
    if (parent < 0 || partners[parent] < 0) continue;
    const Eigen::Vector3d there_m =
        places_m[partners[parent]] +
        Eigen::Vector3d(-1.0, 1.0, 1.0).cwiseProduct(places_m[j] - places_m[parent]);
    double nearest_m = 0.01 + 0.1 * joints[j].offset_m.cast<double>().norm();
    int found = kNoPartner;
    for (int k = 0; k < std::ssize(joints); ++k) {
      if (!is_free(k) || joints[k].parent != partners[parent]) continue;
      const double far_m = (places_m[k] - there_m).norm();
      if (far_m >= nearest_m) continue;
      nearest_m = far_m;
      found = k;
    }
    partners[j] = found;
    if (found != kNoPartner) partners[found] = j;
  }
  return partners;
}

}  // namespace

Result<Clip> mirrored(const Clip& clip) {
  Clip out = is_acclaim(*clip.skeleton) ? with_zyx_channels(clip) : clip;
  const Skeleton& skeleton = *out.skeleton;
  if (out.frames() < 2) return fail("cannot be mirrored: it has a single frame", clip.path);
  const std::vector<int> partners = partners_of(skeleton);
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const int parent = skeleton.joints[j].parent;
    const bool alike = partners[j] >= 0 &&
                       skeleton.joints[partners[j]].parent == (parent < 0 ? -1 : partners[parent]);
    if (alike) continue;
    return fail("cannot be mirrored: joint " + in_quotes(skeleton.joints[j].name) +
                    " has no partner on the other side",
                clip.path);
  }
  FramesClip frames(out.skeleton);
  for (int i = 0; i < out.frames(); ++i) {
    const Frame from = out.frame(i);
    Frame frame = from;
    frame.angle_count = 0;  // so that they follow from the rotations
    frame.root_position_m[0] = -frame.root_position_m[0];
    for (int j = 0; j < frame.joint_count; ++j) {
      const int k = partners[j];
      Eigen::Quaterniond turn = T_above(skeleton, k) * to_eigen_double(from.rotation_xyzw[k]) *
                                skeleton.joints[k].T_world_joint.conjugate();
      turn.y() = -turn.y();
      turn.z() = -turn.z();
      frame.rotation_xyzw[j] = from_eigen(local_from_canonical(skeleton, j, turn));
      frame.valid[j] = from.valid[k];
    }
    frames.add(frame);
  }
  std::vector<double> time_s(static_cast<std::size_t>(out.frames()));
  for (int i = 0; i < out.frames(); ++i) time_s[i] = out.time_of_s(i);
  auto made = TRY(frames.finish(clip.path, out.frame_rate_hz, std::move(time_s)));
  out.channels = std::move(made.channels);
  return out;
}

}  // namespace posed::clip
