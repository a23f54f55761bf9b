#include "proto/rig/borrow.hpp"

#include <array>

namespace posed::rig {
namespace {

constexpr int kBorrowedBones = 4;

struct BorrowedLimb {
  Bone first;  // the left one's; three more follow
  Bone upper;
  std::string_view name;
};
constexpr BorrowedLimb kBorrowedLeg{Bone::kLeftUpperLeg, Bone::kLeftUpperLeg, "leg"};
constexpr BorrowedLimb kBorrowedArm{Bone::kLeftShoulder, Bone::kLeftUpperArm, "arm"};

Bone bone_after(Bone bone, int count) { return static_cast<Bone>(static_cast<int>(bone) + count); }

bool is_whole(const BoneJoints& bones, const BorrowedLimb& limb, Side side) {
  return bones.has(on(side, limb.upper)) && bones.has(on(side, bone_after(limb.upper, 1)));
}

// From the right to the left one of a pair of limbs, in the zero pose.
Vec line_between(const Figure& figure, const BoneJoints& bones, const BorrowedLimb& limb) {
  const int left = bones[on(Side::kLeft, limb.upper)];
  const int right = bones[on(Side::kRight, limb.upper)];
  const int top = figure.common({left, right});
  const Vec line = figure.between(top, left).value_or(Vec::Zero()) -
                   figure.between(top, right).value_or(Vec::Zero());
  return line.norm() > 0.0 ? nearest_axis(direction(line), 12).value_or(direction(line)) : line;
}

// The turn of `joint` against `top` above it in one pose.
Eigen::Quaterniond turn_below(const Figure& figure, const RigPoses& poses, int pose, int top,
                              int joint) {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  const std::size_t first =
      static_cast<std::size_t>(pose) * static_cast<std::size_t>(figure.size());
  for (; joint != top; joint = figure[joint].parent) {
    turn = poses.rotation[first + static_cast<std::size_t>(joint)] * turn;
  }
  return turn;
}

// A joint that mirrors `of`, which turns against `above` in the figure.
struct Borrowed {
  RigJoint joint;
  JointName name;
  int of = 0;
  int above = 0;
};

// A joint that is left of a limb is the bone that the other limb's joint of its name is.
void name_stump(const std::vector<JointName>& names, const BorrowedLimb& limb, Side side,
                BoneJoints& bones) {
  const Side other = side == Side::kLeft ? Side::kRight : Side::kLeft;
  std::array<int, kBorrowedBones> named;
  named.fill(-1);
  for (int k = 0; k < kBorrowedBones; ++k) {
    const int mine = bones[on(side, bone_after(limb.first, k))];
    if (mine < 0) continue;
    int at = k;
    for (int of = 0; of < kBorrowedBones; ++of) {
      const int theirs = bones[on(other, bone_after(limb.first, of))];
      const bool is_same = theirs >= 0 && names[mine].stem == names[theirs].stem &&
                           names[mine].digits == names[theirs].digits;
      if (is_same) at = of;
      if (is_same) break;
    }
    if (named[at] >= 0) return;  // two of one name say nothing
    named[at] = mine;
  }
  for (int k = 0; k < kBorrowedBones; ++k) bones.set(on(side, bone_after(limb.first, k)), named[k]);
}

// The limb of `side` as the mirror image of the other one's, below what is there of it.
void borrow(const Figure& figure, const std::vector<JointName>& names, const BoneJoints& bones,
            const BorrowedLimb& limb, Side side, const Mat& mirror, std::vector<Borrowed>& out) {
  const Side other = side == Side::kLeft ? Side::kRight : Side::kLeft;
  int above = -1;   // in the other limb
  int parent = -1;  // in this one
  for (int k = 0; k < kBorrowedBones; ++k) {
    const int of = bones[on(other, bone_after(limb.first, k))];
    const int mine = bones[on(side, bone_after(limb.first, k))];
    if (of < 0) continue;
    if (above < 0) above = parent = figure[of].parent;
    if (above < 0 || !figure.below(above, of)) return;
    if (mine >= 0) {
      parent = mine;
    } else {
      Borrowed joint{.joint = {.name = figure[of].name,
                               .parent = parent,
                               .offset = mirror * figure.between(above, of).value_or(Vec::Zero()),
                               .end_site = {}},
                     .name = names[of],
                     .of = of,
                     .above = above};
      if (const auto& end = figure[of].end_site) joint.joint.end_site = mirror * *end;
      joint.name.side = side == Side::kLeft ? NameSide::kLeft : NameSide::kRight;
      parent = figure.size() + static_cast<int>(out.size());
      out.push_back(std::move(joint));
    }
    above = of;
  }
}

// The poses with the mirrored turns of the borrowed joints; none where they do not fit the figure.
RigPoses mirrored_poses(const RigPoses& poses, const Figure& figure, const Mat& mirror,
                        const std::vector<Borrowed>& borrowed) {
  RigPoses out;
  const auto joints = static_cast<std::size_t>(figure.size());
  const std::size_t values = static_cast<std::size_t>(std::max(poses.count, 0)) * joints;
  if (poses.rotation.size() != values || poses.position.size() != values) return out;
  out.count = poses.count;
  for (int i = 0; i < poses.count; ++i) {
    for (std::size_t j = 0; j < joints; ++j) {
      out.rotation.push_back(poses.rotation[i * joints + j]);
      out.position.push_back(poses.position[i * joints + j]);
    }
    for (const Borrowed& joint : borrowed) {
      const auto turn = turn_below(figure, poses, i, joint.above, joint.of);
      out.rotation.emplace_back(Mat(mirror * turn.toRotationMatrix() * mirror));
      out.position.push_back(joint.joint.offset);
    }
  }
  return out;
}

}  // namespace

std::optional<WholePerson> with_borrowed_limbs(const RigInput& input, const Figure& figure,
                                               const std::vector<JointName>& names,
                                               BoneJoints bones) {
  const auto both = [&bones](const BorrowedLimb& limb) {
    return is_whole(bones, limb, Side::kLeft) && is_whole(bones, limb, Side::kRight);
  };
  const bool has_legs = both(kBorrowedLeg);
  const BorrowedLimb& lost = has_legs ? kBorrowedArm : kBorrowedLeg;
  if (has_legs == both(kBorrowedArm)) return std::nullopt;
  const bool has_left = is_whole(bones, lost, Side::kLeft);
  if (!has_left && !is_whole(bones, lost, Side::kRight)) return std::nullopt;
  const Side side = has_left ? Side::kRight : Side::kLeft;
  name_stump(names, lost, side, bones);
  const Vec line = line_between(figure, bones, has_legs ? kBorrowedLeg : kBorrowedArm);
  if (!(line.norm() > 0.0)) return std::nullopt;
  const Mat mirror = Mat::Identity() - 2.0 * line * line.transpose();
  std::vector<Borrowed> borrowed;
  borrow(figure, names, bones, lost, side, mirror, borrowed);
  if (borrowed.empty()) return std::nullopt;
  WholePerson whole{.input = input, .names = names, .notes = {}};
  whole.input.poses = mirrored_poses(input.poses, figure, mirror, borrowed);
  for (const Borrowed& joint : borrowed) {
    whole.input.joints.push_back(joint.joint);
    whole.names.push_back(joint.name);
  }
  whole.notes.push_back("the " + std::string(side_text(side)) + ' ' + std::string(lost.name) +
                        " is not whole: the person is recognised as if it were like the other one");
  return whole;
}

}  // namespace posed::rig
