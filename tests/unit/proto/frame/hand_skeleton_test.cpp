#include <catch2/catch.hpp>

#include <array>
#include <limits>

#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/allocations.hpp"

namespace posed {
namespace {

constexpr int kThumb = 0, kIndex = 1, kMiddle = 2, kRing = 3, kLittle = 4;

std::size_t angle(int finger, int joint, int axis) {
  return static_cast<std::size_t>(kFingerChannels * finger + 3 * joint + axis);
}

// Global rotations and positions of the joints, the wrist at the origin and not turned.
struct World {
  std::array<Eigen::Quaterniond, kHandSkeletonJoints> rotation;
  std::array<Eigen::Vector3d, kHandSkeletonJoints> position_m;

  [[nodiscard]] Eigen::Vector3d tip_m(const Skeleton& skeleton, int finger) const {
    const int last = hand_joint(finger, 2);
    return position_m[last] + rotation[last] * skeleton.joints[last].end_site_m.value();
  }
};

World world_of(const Skeleton& skeleton, const HandAngles& angles) {
  Frame frame;
  set_hand_angles(skeleton, angles, frame);
  World world;
  for (std::size_t j = 0; j < kHandSkeletonJoints; ++j) {
    const Joint& joint = skeleton.joints[j];
    const Eigen::Quaterniond local = to_eigen_double(frame.rotation_xyzw[j]);
    if (joint.parent < 0) {
      world.rotation[j] = local;
      world.position_m[j] = joint.offset_m;
    } else {
      const auto parent = static_cast<std::size_t>(joint.parent);
      world.rotation[j] = world.rotation[parent] * local;
      world.position_m[j] = world.position_m[parent] + world.rotation[parent] * joint.offset_m;
    }
  }
  return world;
}

HandAngles fist() {
  HandAngles angles{};
  for (int finger = kIndex; finger <= kLittle; ++finger) {
    angles[angle(finger, 0, 0)] = 85 * kDegree;
    angles[angle(finger, 1, 0)] = 100 * kDegree;
    angles[angle(finger, 2, 0)] = 60 * kDegree;
  }
  return angles;
}

// A pose in which all angles are different and not zero.
HandAngles any_pose() {
  HandAngles angles;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    angles[i] = 0.3 * std::sin(1.0 + 2.3 * static_cast<double>(i));
  }
  return angles;
}

}  // namespace

TEST_CASE("the two orders of a hand's channels are each other's inverse") {
  CHECK(kAngleOfChannel[0] == 2);  // thumb1: z, x, y
  CHECK(kAngleOfChannel[1] == 0);
  CHECK(kAngleOfChannel[2] == 1);
  for (std::size_t i = 0; i < kHandChannels; ++i) {
    CHECK(kAngleOfChannel[kChannelOfAngle[i]] == i);
    CHECK(kChannelOfAngle[kAngleOfChannel[i]] == i);
  }
}

TEST_CASE("a hand's skeleton has the joints, bones and channels of hand45") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const Skeleton skeleton = hand_skeleton(side);
    const bool left = side == Side::kLeft;
    REQUIRE(skeleton.joints.size() == 16);
    REQUIRE(skeleton.channels.size() == 45);
    CHECK(skeleton.name == (left ? "hand45 left adult" : "hand45 right adult"));
    CHECK(skeleton.joints[0].name == (left ? "leftHand" : "rightHand"));
    CHECK(skeleton.joints[hand_joint(kThumb, 0)].name ==
          (left ? "leftThumbMetacarpal" : "rightThumbMetacarpal"));
    CHECK(skeleton.joints[hand_joint(kLittle, 2)].bone ==
          (left ? Bone::kLeftLittleDistal : Bone::kRightLittleDistal));
    CHECK(hand_side(skeleton) == side);
    const Channel& channel = skeleton.channels[kChannelOfAngle[angle(kIndex, 1, 0)]];
    CHECK(channel.joint == hand_joint(kIndex, 1));
    CHECK(channel.axis == Axis::kX);
    CHECK(channel.max == Approx(135 * kDegree));
  }
  CHECK(hand_skeleton(Side::kLeft).id != hand_skeleton(Side::kRight).id);
  Skeleton other = hand_skeleton(Side::kLeft);
  other.joints.pop_back();
  CHECK_FALSE(hand_side(other));
}

TEST_CASE("the flat hand points forward, and a finger closes towards the palm") {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  const World flat = world_of(skeleton, {});
  for (int finger = kIndex; finger <= kLittle; ++finger) {
    const Eigen::Vector3d along =
        flat.tip_m(skeleton, finger) - flat.position_m[hand_joint(finger, 0)];
    CHECK(along.normalized().z() == Approx(1.0));
  }
  CHECK(flat.tip_m(skeleton, kThumb).x() > flat.tip_m(skeleton, kIndex).x());
  CHECK(flat.tip_m(skeleton, kIndex).x() > flat.tip_m(skeleton, kLittle).x());
  const World closed = world_of(skeleton, fist());
  for (int finger = kIndex; finger <= kLittle; ++finger) {
    const Eigen::Vector3d knuckle = closed.position_m[hand_joint(finger, 1)];
    const Eigen::Vector3d tip = closed.tip_m(skeleton, finger);
    CHECK(knuckle.y() < -0.02);    // below the palm
    CHECK(tip.z() < knuckle.z());  // and back towards the wrist
  }
}

TEST_CASE("a joint turns as Rz(twist) Rx(flexion) Ry(spread), spread away from the middle") {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  const HandAngles angles = any_pose();
  Frame frame;
  set_hand_angles(skeleton, angles, frame);
  for (const int finger : {kIndex, kMiddle}) {
    for (int joint = 0; joint < kFingerJoints; ++joint) {
      const Eigen::Quaterniond expected = axis_rotation(Axis::kZ, angles[angle(finger, joint, 2)]) *
                                          axis_rotation(Axis::kX, angles[angle(finger, joint, 0)]) *
                                          axis_rotation(Axis::kY, angles[angle(finger, joint, 1)]);
      const auto index = static_cast<std::size_t>(hand_joint(finger, joint));
      CHECK(angle_between_rad(to_eigen_double(frame.rotation_xyzw[index]), expected) < 1e-6);
    }
  }
  for (int finger = 0; finger < kFingers; ++finger) {
    HandAngles spread{};
    spread[angle(finger, 0, 1)] = 10 * kDegree;
    const double moved_m = world_of(skeleton, spread).tip_m(skeleton, finger).x() -
                           world_of(skeleton, {}).tip_m(skeleton, finger).x();
    INFO(kFingerNames[static_cast<std::size_t>(finger)]);
    CHECK((finger >= kRing ? -moved_m : moved_m) > 0.005);
  }
}

TEST_CASE("a left hand is the mirror image of the right with the same angles") {
  const Skeleton right = hand_skeleton(Side::kRight);
  const Skeleton left = hand_skeleton(Side::kLeft);
  for (const HandAngles& angles : {HandAngles{}, fist(), any_pose()}) {
    const World one = world_of(right, angles);
    const World other = world_of(left, angles);
    for (int finger = 0; finger < kFingers; ++finger) {
      const Eigen::Vector3d tip = mirrored(Side::kLeft, one.tip_m(right, finger));
      CHECK((tip - other.tip_m(left, finger)).norm() < 1e-6);
    }
    const auto j = static_cast<std::size_t>(hand_joint(kRing, 1));
    CHECK((mirrored(Side::kLeft, one.position_m[j]) - other.position_m[j]).norm() < 1e-6);
  }
}

TEST_CASE("on the canonical humanoid a flat hand is the T-pose and a fist curls downwards") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const Skeleton skeleton = hand_skeleton(side);
    const double outwards = side == Side::kLeft ? 1.0 : -1.0;
    // Lc = T_parent L T_joint^-1; the fingers of a T-pose lie along the arm, palm down.
    const auto canonical = [&](const Frame& frame, int joint) {
      const Joint& it = skeleton.joints[static_cast<std::size_t>(joint)];
      const Joint& parent = skeleton.joints[static_cast<std::size_t>(it.parent)];
      return Eigen::Quaterniond(
          parent.T_world_joint *
          to_eigen_double(frame.rotation_xyzw[static_cast<std::size_t>(joint)]) *
          it.T_world_joint.conjugate());
    };
    const Joint& index = skeleton.joints[hand_joint(kIndex, 1)];
    CHECK((index.T_world_joint * index.offset_m.normalized()).x() == Approx(outwards));
    Frame flat, closed;
    set_hand_angles(skeleton, {}, flat);
    set_hand_angles(skeleton, fist(), closed);
    Eigen::Quaterniond chain = Eigen::Quaterniond::Identity();
    for (int j = 0; j < kFingerJoints; ++j) {
      CHECK(angle_between_rad(canonical(flat, hand_joint(kMiddle, j)),
                              Eigen::Quaterniond::Identity()) < 1e-6);
      chain = chain * canonical(closed, hand_joint(kMiddle, j));
      const Eigen::Vector3d bone = chain * Eigen::Vector3d(outwards, 0, 0);
      if (j == 0) CHECK(bone.y() < -0.9);             // straight down
      if (j == 1) CHECK(bone.x() * outwards < -0.9);  // back towards the wrist
    }
  }
}

TEST_CASE(
    "angles go through a frame unchanged, without allocation, and a missing one is reported") {
  const Skeleton skeleton = hand_skeleton(Side::kLeft);
  HandAngles angles = any_pose();
  Frame frame;
  const std::uint64_t before = test::allocations();
  set_hand_angles(skeleton, angles, frame);
  const HandAngles back = hand_angles(frame);
  CHECK(test::allocations() == before);
  for (std::size_t i = 0; i < angles.size(); ++i) CHECK(back[i] == Approx(angles[i]).margin(1e-7));
  CHECK(frame.skeleton == skeleton.id);
  CHECK(frame.joint_count == kHandSkeletonJoints);
  CHECK(frame.angle_count == kHandChannels);
  CHECK(frame.valid.count() == kHandSkeletonJoints);
  angles[angle(kRing, 1, 0)] = std::numeric_limits<double>::quiet_NaN();
  set_hand_angles(skeleton, angles, frame);
  CHECK(frame.valid.count() == kHandSkeletonJoints - 1);
  CHECK_FALSE(frame.valid[static_cast<std::size_t>(hand_joint(kRing, 1))]);
  CHECK(std::isnan(hand_angles(frame)[angle(kRing, 1, 0)]));
}

TEST_CASE("every built-in hand is valid, and an invalid one is refused with its line") {
  REQUIRE_FALSE(hand_shapes().empty());
  CHECK(default_hand_shape().name == kDefaultHandShape);
  CHECK(find_hand_shape("paw").error().text() == "there is no hand 'paw'; there are adult");
  const auto error = [](const std::string& text) {
    const auto shape = parse_hand_shape(text, "h.toml");
    REQUIRE_FALSE(shape.has_value());
    return shape.error().text();
  };
  CHECK(error("name = 1 2").starts_with("h.toml:1: "));
  CHECK(error("").starts_with("h.toml:1: name is missing"));
  CHECK(error("name = \"h\"\n") == "h.toml:1: thumb is missing; a hand has five fingers");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text(hand_texts()[0].content);
    const std::size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return error(text.replace(at, from.size(), to));
  };
  CHECK(changed("name =", "claw = 3\nname =") ==
        "h.toml:5: unknown key 'claw'; known here: index, little, middle, name, ring, thumb");
  CHECK(changed("base_mm", "bass_mm").starts_with("h.toml:7: thumb.base_mm is missing"));
  CHECK(changed("length_mm = [44, 33, 27]", "length_mm = [44, -3, 27]") ==
        "h.toml:11: thumb.length_mm = -3 is out of range: it takes a number from 0.1 to 1000");
  CHECK(changed("[-60, 90], ", "")
            .ends_with("limits are three pairs, [least, most] of joints 1 to 3"));
  CHECK(changed("[-60, 90]", "[10, 90]").ends_with("with 0 between them"));
}

}  // namespace posed
