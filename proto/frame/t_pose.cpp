#include "proto/frame/t_pose.hpp"

#include <array>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed {
namespace {

constexpr double kShort_m = 1e-6;

enum class BodyPart : std::uint8_t { kTorso, kLimb, kFoot, kThumb };

BodyPart part_of(Bone bone) {
  if (bone <= Bone::kHead) return BodyPart::kTorso;
  switch (bone) {
    case Bone::kLeftFoot:
    case Bone::kRightFoot:
    case Bone::kLeftToes:
    case Bone::kRightToes:
      return BodyPart::kFoot;
    case Bone::kLeftThumbMetacarpal:
    case Bone::kLeftThumbProximal:
    case Bone::kLeftThumbDistal:
    case Bone::kRightThumbMetacarpal:
    case Bone::kRightThumbProximal:
    case Bone::kRightThumbDistal:
      return BodyPart::kThumb;
    default:
      return BodyPart::kLimb;
  }
}

// The direction of the bone in T-pose.
Eigen::Vector3d t_direction(Bone bone) {
  switch (part_of(bone)) {
    case BodyPart::kTorso:
      return Eigen::Vector3d::UnitY();
    case BodyPart::kFoot:
      return Eigen::Vector3d::UnitZ();
    default:
      break;
  }
  if (bone == Bone::kLeftUpperLeg || bone == Bone::kLeftLowerLeg || bone == Bone::kRightUpperLeg ||
      bone == Bone::kRightLowerLeg) {
    return -Eigen::Vector3d::UnitY();
  }
  return bone_name(bone).starts_with("left") ? Eigen::Vector3d::UnitX()
                                             : Eigen::Vector3d(-Eigen::Vector3d::UnitX());
}

// From `joint` to the nearest descendant at another position: a joint or the end site.
Eigen::Vector3d to_next(const Skeleton& skeleton, int joint) {
  for (int child = joint + 1; child < std::ssize(skeleton.joints); ++child) {
    if (skeleton.joints[child].parent != joint) continue;
    const Eigen::Vector3d& offset = skeleton.joints[child].offset_m;
    if (offset.norm() > kShort_m) return offset;
    const Eigen::Vector3d further = to_next(skeleton, child);
    if (further.norm() > kShort_m) return further;
  }
  return skeleton.joints[joint].end_site_m.value_or(Eigen::Vector3d::Zero());
}

// From `joint` to the joint of `bone` in the zero pose; zero when that is not below it.
Eigen::Vector3d to_bone(const Skeleton& skeleton, int joint, Bone bone) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  int at = skeleton.joint_of(bone);
  for (; at > joint; at = skeleton.joints[at].parent) direction += skeleton.joints[at].offset_m;
  return at == joint ? direction : Eigen::Vector3d::Zero();
}

// From the bone to the next one of its limb, in the zero pose and in the joint's frame; zero when
// it is unknown. For a trunk bone the next one up the trunk, skipping bones that a format omits.
Eigen::Vector3d rest_direction(const Skeleton& skeleton, int joint) {
  const Bone bone = *skeleton.joints[joint].bone;
  // Consecutive bones of the shoulders, arms, legs, fingers and trunk are consecutive in the enum.
  const auto after = [](Bone b) { return static_cast<Bone>(static_cast<int>(b) + 1); };
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  if (part_of(bone) == BodyPart::kTorso) {
    for (Bone next = after(bone); next <= Bone::kHead; next = after(next)) {
      direction = to_bone(skeleton, joint, next);
      if (direction.norm() > kShort_m) return direction;
    }
    if (bone != Bone::kHead) return direction;
  } else if (bone == Bone::kLeftHand) {
    direction = to_bone(skeleton, joint, Bone::kLeftMiddleProximal);
  } else if (bone == Bone::kRightHand) {
    direction = to_bone(skeleton, joint, Bone::kRightMiddleProximal);
  } else {
    direction = to_bone(skeleton, joint, after(bone));
  }
  return direction.norm() > kShort_m ? direction : to_next(skeleton, joint);
}

// True when the bone continues its parent straight on, so that it can take its parent's T. The
// twist of a forearm or hand about its length differs between people's walks; that of the upper arm
// differs less.
bool follows_parent(Bone bone) {
  switch (bone) {
    case Bone::kLeftLowerArm:
    case Bone::kLeftHand:
    case Bone::kRightLowerArm:
    case Bone::kRightHand:
      return true;
    default:
      return bone >= Bone::kLeftThumbMetacarpal;
  }
}

double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// The nearest rotation that maps axes to axes.
Eigen::Quaterniond snapped(const Eigen::Quaterniond& q) {
  constexpr std::array<std::array<int, 3>, 6> kOrders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  const Eigen::Matrix3d r = q.toRotationMatrix();
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double best_trace = -4.0;
  for (const auto& order : kOrders) {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) m(order[i], i) = ((signs >> i) & 1) != 0 ? -1.0 : 1.0;
      const double trace = (r.transpose() * m).trace();
      if (m.determinant() > 0 && trace > best_trace) {
        best_trace = trace;
        best = m;
      }
    }
  }
  return Eigen::Quaterniond(best);
}

}  // namespace

void set_t_frames(Skeleton& skeleton, const KnownT& known) {
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    Joint& joint = skeleton.joints[j];
    const Eigen::Quaterniond T_parent = joint.parent < 0
                                            ? Eigen::Quaterniond::Identity()
                                            : skeleton.joints[joint.parent].T_world_joint;
    joint.T_world_joint = T_parent;
    if (j < std::ssize(known) && known[j]) {
      joint.T_world_joint = *known[j];
      continue;
    }
    if (!joint.bone || part_of(*joint.bone) == BodyPart::kThumb) continue;
    const Eigen::Vector3d direction = T_parent * rest_direction(skeleton, j);
    const Eigen::Vector3d axis = t_direction(*joint.bone);
    const bool upright = angle_rad(direction, axis) < 45 * kDegree;
    if (part_of(*joint.bone) == BodyPart::kTorso && upright) continue;
    joint.T_world_joint = (minimal_rotation(direction, axis) * T_parent).normalized();
  }
}

bool zero_pose_is_t(const Skeleton& skeleton) {
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const auto& bone = skeleton.joints[j].bone;
    if (!bone || part_of(*bone) == BodyPart::kThumb) continue;
    const Eigen::Vector3d direction = rest_direction(skeleton, j);
    const double limit_rad = (part_of(*bone) == BodyPart::kFoot ? 80 : 45) * kDegree;
    if (direction.norm() > kShort_m && angle_rad(direction, t_direction(*bone)) > limit_rad) {
      return false;
    }
  }
  return true;
}

KnownT t_frames_from_mean_pose(const Skeleton& skeleton,
                               std::span<const Eigen::Quaterniond> standing) {
  KnownT known(skeleton.joints.size());
  Eigen::Quaterniond T_parent = Eigen::Quaterniond::Identity();
  for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
    const Joint& joint = skeleton.joints[j];
    T_parent = joint.parent < 0 ? Eigen::Quaterniond::Identity() : *known[joint.parent];
    known[j] = T_parent;
    if (!joint.bone || part_of(*joint.bone) == BodyPart::kThumb) continue;
    const Eigen::Vector3d direction = rest_direction(skeleton, j);
    const Eigen::Vector3d axis = t_direction(*joint.bone);
    if (direction.norm() < kShort_m) continue;
    const bool lies_right = angle_rad(T_parent * direction, axis) < 20 * kDegree;
    if (lies_right && follows_parent(*joint.bone)) continue;
    known[j] = snapped(minimal_rotation(standing[j] * direction, axis) * standing[j]);
  }
  return known;
}

std::string axes_text(const Eigen::Quaterniond& T) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d to = T * Eigen::Vector3d::Unit(i);
    int axis = 0;
    to.cwiseAbs().maxCoeff(&axis);
    text += to[axis] < 0 ? '-' : '+';
    text += "xyz"[axis];
  }
  return text;
}

std::optional<Eigen::Quaterniond> axes_from_text(std::string_view text) {
  if (text.size() != 6) return std::nullopt;
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const char sign = text[2 * static_cast<std::size_t>(i)];
    const char axis = text[2 * static_cast<std::size_t>(i) + 1];
    if ((sign != '+' && sign != '-') || axis < 'x' || axis > 'z') return std::nullopt;
    m(axis - 'x', i) = sign == '-' ? -1.0 : 1.0;
  }
  if (std::abs(m.determinant() - 1.0) > 0.5) return std::nullopt;
  return Eigen::Quaterniond(m);
}

}  // namespace posed
