// Knees and elbows bend one way (models/style/live/hinges.hpp).
#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/hinges.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed {
namespace {

// A walker whose T-pose has one joint bent about an axis of the T-pose.
Frame bent(const clip::Clip& clip, Bone bone, Axis axis, double angle_deg) {
  const Skeleton& skeleton = *clip.skeleton;
  Frame frame = clip.frame(0);
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const bool is_it = static_cast<int>(j) == skeleton.joint_of(bone);
    const Eigen::Quaterniond turn =
        is_it ? axis_rotation(axis, angle_deg * kDegree) : Eigen::Quaterniond::Identity();
    frame.rotation_xyzw[j] = from_eigen(local_from_canonical(skeleton, j, turn));
  }
  return frame;
}

}  // namespace

TEST_CASE("a hinge that bends backwards is held, and what the performer's own does stays",
          "[style]") {
  const clip::Clip clip = motion::make_walker({}).value();
  const style::Hinges hinges(*clip.skeleton);
  struct Case {
    Bone bone;
    Axis axis;
    double sign;  // of a bend forwards
  };
  for (const Case& at :
       {Case{Bone::kLeftLowerLeg, Axis::kX, 1.0}, Case{Bone::kRightLowerLeg, Axis::kX, 1.0},
        Case{Bone::kLeftLowerArm, Axis::kY, -1.0}, Case{Bone::kRightLowerArm, Axis::kY, 1.0}}) {
    const auto pose = [&](double deg) { return bent(clip, at.bone, at.axis, at.sign * deg); };
    const auto held_deg = [&](double own, double styled) {
      Frame frame = pose(styled);
      return hinges.hold(pose(own).rotation_xyzw, frame) / kDegree;
    };
    CHECK(held_deg(5.0, 60.0) == 0.0);
    CHECK(held_deg(5.0, -23.0) == Approx(20.0).margin(0.1));  // three degrees are left
    CHECK(held_deg(40.0, -79.0) == Approx(76.0).margin(0.1));
    CHECK(held_deg(40.0, 170.0) == 0.0);
    CHECK(held_deg(-8.0, -8.0) == 0.0);                         // his own knee is there already
    CHECK(held_deg(5.0, -3.0) == Approx(1.1).margin(0.05));     // it gives softly
    CHECK(held_deg(-15.0, -40.0) == Approx(11.0).margin(0.1));  // half a hinge
    CHECK(held_deg(-25.0, -60.0) == 0.0);                       // no hinge of a person
    Frame frame = pose(30.0);
    const Frame before = frame;
    hinges.hold(pose(30.0).rotation_xyzw, frame);
    CHECK(frame.rotation_xyzw == before.rotation_xyzw);
  }
}

}  // namespace posed
