#include "daemon/tools/picture/figure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Geometry>

#include "models/motion/kinematics.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::picture {
namespace {

constexpr double kQuarter_rad = 40.0 * kDegree;  // of a three-quarter view, from the front
constexpr double kAbove_rad = 8.0 * kDegree;

}  // namespace

Result<View> view_from_name(std::string_view name) {
  if (name == "front") return View::kFront;
  if (name == "side") return View::kSide;
  if (name == "three-quarter") return View::kThreeQuarter;
  return misuse("the view " + in_quotes(name) + " is none of front, side and three-quarter");
}

std::string_view view_words(View view) {
  if (view == View::kFront) return "from the front";
  return view == View::kSide ? "from the side" : "in three-quarter view";
}

Camera::Camera(View view, const Facing& facing) : up_(facing.up), near_(facing.forward) {
  if (view == View::kSide) near_ = facing.side;
  if (view == View::kThreeQuarter) {
    near_ = std::cos(kQuarter_rad) * facing.forward + std::sin(kQuarter_rad) * facing.side;
    up_ = std::cos(kAbove_rad) * facing.up - std::sin(kAbove_rad) * near_;
    near_ = std::cos(kAbove_rad) * near_ + std::sin(kAbove_rad) * facing.up;
  }
  right_ = up_.cross(near_);
}

namespace {

using Eigen::Vector3d;

constexpr std::string_view kLeft = "#0072b2", kRight = "#d55e00", kMiddle = "#4d4d4d";
// Thumb to little.
constexpr std::array<std::string_view, kFingers> kFingerColours{"#d55e00", "#e69f00", "#009e73",
                                                                "#0072b2", "#cc79a7"};
// Widths of sticks, as a part of the figure's reach.
constexpr double kTrunkWidth = 0.05, kLimbWidth = 0.038, kFingerWidth = 0.012;
constexpr double kHeadRadius = 0.085;
// Widths of a hand's capsules [m], from the palm outwards.
constexpr double kPalmWidth_m = 0.022;
constexpr std::array<double, kFingerJoints> kCapsuleWidth_m{0.02, 0.017, 0.015};

bool is_finger(Bone bone) { return bone >= Bone::kLeftThumbMetacarpal; }

std::string_view side_colour(std::optional<Bone> bone, std::string_view otherwise) {
  if (!bone) return otherwise;
  const std::string_view name = bone_name(*bone);
  if (name.starts_with("left")) return kLeft;
  return name.starts_with("right") ? kRight : kMiddle;
}

// The colour of what begins at a joint: a joint without a canonical bone belongs to its parent.
std::string_view colour_of(const Skeleton& skeleton, int joint) {
  const Joint& at = skeleton.joints[joint];
  return side_colour(at.bone, at.parent < 0 ? kMiddle : colour_of(skeleton, at.parent));
}

// Which finger of a robot a joint is part of, from 1 on: fingers begin where the skeleton branches
// first. 0: none, it is part of the palm.
std::size_t finger_of(const Skeleton& skeleton, int joint) {
  const auto& joints = skeleton.joints;
  const auto children_until = [&](int parent, int end) {
    return std::count_if(joints.begin(), joints.begin() + end,
                         [&](const Joint& other) { return other.parent == parent; });
  };
  const int all = static_cast<int>(joints.size());
  int palm = 0;
  while (palm + 1 < all && children_until(palm, all) == 1) ++palm;
  if (joint <= palm) return 0;
  while (joints[joint].parent > palm) joint = joints[joint].parent;
  return 1 + static_cast<std::size_t>(children_until(palm, joint));
}

double reach_m(const Skeleton& skeleton) {
  std::vector<double> way_m(skeleton.joints.size(), 0.0);
  double longest_m = 0.0;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const bool below_root = joint.parent >= 0 && static_cast<int>(j) != skeleton.root_joint;
    if (below_root) {
      way_m[j] = way_m[joint.parent] + joint.offset_m.norm();
    }
    longest_m = std::max(longest_m, way_m[j] + joint.end_site_m.value_or(Vector3d::Zero()).norm());
  }
  return longest_m;
}

// Joints above the root joint are places in the room, not parts of the body.
bool is_part_of_body(const Skeleton& skeleton, int joint) {
  for (; joint >= 0; joint = skeleton.joints[joint].parent) {
    if (joint == skeleton.root_joint) return true;
  }
  return false;
}

}  // namespace

FigureShape::FigureShape(std::shared_ptr<const Skeleton> skeleton)
    : skeleton_(std::move(skeleton)),
      hand_(hand_side(*skeleton_)),
      reach_m_(std::max(reach_m(*skeleton_), 1e-6)) {
  for (int j = 0; j < static_cast<int>(skeleton_->joints.size()); ++j) {
    if (!skeleton_->capsules.empty()) break;  // a robot looks like them
    if (!is_part_of_body(*skeleton_, j)) continue;
    if (j != skeleton_->root_joint) add_limb(j, false);
    if (skeleton_->joints[j].end_site_m) add_limb(j, true);
  }
  for (const JointCapsule& capsule : skeleton_->capsules) {
    const std::size_t finger = finger_of(*skeleton_, capsule.joint);
    capsule_colours_.push_back(finger == 0 ? kMiddle : kFingerColours[(finger - 1) % kFingers]);
  }
}

void FigureShape::add_limb(int joint, bool tip) {
  const Joint& at = skeleton_->joints[joint];
  // The bone that turns with the joint where the limb begins.
  const int begin = tip ? joint : at.parent;
  Limb limb{.joint = joint, .tip = tip, .width_m = kLimbWidth * reach_m_, .colour = kMiddle};
  if (hand_) {
    const int place = begin - 1;  // of the finger joints, 15 in all; -1: the wrist
    limb.width_m = place < 0 ? kPalmWidth_m : kCapsuleWidth_m[place % kFingerJoints];
    if (place >= 0) limb.colour = kFingerColours[place / kFingerJoints];
  } else {
    limb.colour = colour_of(*skeleton_, begin);
    const auto& bone = skeleton_->joints[begin].bone;
    if (limb.colour == kMiddle) limb.width_m = kTrunkWidth * reach_m_;
    if ((bone && is_finger(*bone)) || (at.bone && is_finger(*at.bone))) {
      limb.width_m = kFingerWidth * reach_m_;
    }
    if (tip && bone == Bone::kHead) return;  // the head is drawn there
  }
  limbs_.push_back(limb);
}

Figure FigureShape::pose(const Frame& frame) const {
  const motion::WorldPose world = motion::world_pose(*skeleton_, frame);
  const auto tip_m = [&](std::size_t j) -> Vector3d {
    const Vector3d local_m = skeleton_->joints[j].end_site_m.value_or(Vector3d::Zero());
    return world.position_m[j] + world.rotation[j] * local_m;
  };
  Figure figure;
  figure.place_m = world.position_m[skeleton_->root_joint];
  figure.place_m.y() = 0.0;
  for (const Limb& limb : limbs_) {
    const std::size_t j = limb.joint;
    const std::size_t parent = std::max(0, skeleton_->joints[j].parent);
    figure.sticks.push_back({.from_m = world.position_m[limb.tip ? j : parent],
                             .to_m = limb.tip ? tip_m(j) : world.position_m[j],
                             .width_m = limb.width_m,
                             .colour = limb.colour});
  }
  for (std::size_t i = 0; i < skeleton_->capsules.size(); ++i) {
    const JointCapsule& capsule = skeleton_->capsules[i];
    const std::size_t j = capsule.joint;
    figure.sticks.push_back({.from_m = world.position_m[j] + world.rotation[j] * capsule.from_m,
                             .to_m = world.position_m[j] + world.rotation[j] * capsule.to_m,
                             .width_m = 2.0 * capsule.radius_m,
                             .colour = capsule_colours_[i]});
  }
  const int head = hand_ ? -1 : skeleton_->joint_of(Bone::kHead);
  if (head >= 0) {
    const std::size_t j = head;
    const double radius_m = kHeadRadius * reach_m_;
    // Without a tip the head continues the neck.
    const Vector3d local_m =
        skeleton_->joints[j].end_site_m.value_or(skeleton_->joints[j].offset_m).normalized();
    figure.head = {.centre_m = world.position_m[j] + world.rotation[j] * (radius_m * local_m),
                   .radius_m = radius_m};
  }
  return figure;
}

Facing FigureShape::facing(double heading_rad) const {
  if (hand_) {
    // Zero angles are a hand with the palm down and the fingers along +Z; a right thumb is at +X.
    return {.up = Vector3d::UnitZ(),
            .forward = -Vector3d::UnitY(),
            .side = *hand_ == Side::kRight ? Vector3d(Vector3d::UnitX()) : -Vector3d::UnitX()};
  }
  const Vector3d forward(std::sin(heading_rad), 0.0, std::cos(heading_rad));
  return {.up = Vector3d::UnitY(), .forward = forward, .side = forward.cross(Vector3d::UnitY())};
}

std::string_view FigureShape::legend() const {
  if (!skeleton_->capsules.empty()) return "each finger of the robot has its colour";
  return hand_ ? "thumb dark orange, index light orange, middle green, ring blue, little pink"
               : "left limbs are blue, right ones orange";
}

}  // namespace posed::picture
