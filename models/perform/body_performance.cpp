#include "models/perform/body_performance.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "models/motion/kinematics.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/pose_space.hpp"
#include "proto/clip/frames_clip.hpp"

namespace posed::perform {
namespace {

using Eigen::Vector3d;

// Where the feet of a frame are [m]; none on a skeleton without feet.
std::vector<Vector3d> feet_m(const Skeleton& skeleton, const Frame& frame) {
  const motion::WorldPose pose = motion::world_pose(skeleton, frame);
  std::vector<Vector3d> feet;
  for (const Bone bone : {Bone::kLeftFoot, Bone::kRightFoot}) {
    const int joint = skeleton.joint_of(bone);
    if (joint >= 0) feet.push_back(pose.position_m[static_cast<std::size_t>(joint)]);
  }
  return feet;
}

// Moves the root so that the middle of the feet is where it was; returns how far the feet then are
// from their places [m].
double stand(const Skeleton& skeleton, const std::vector<Vector3d>& places_m, Frame& frame) {
  const std::vector<Vector3d> feet = feet_m(skeleton, frame);
  if (feet.empty()) return 0.0;
  Vector3d shift = Vector3d::Zero();
  for (std::size_t f = 0; f < feet.size(); ++f) shift += places_m[f] - feet[f];
  shift /= static_cast<double>(feet.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.root_position_m[axis] += static_cast<float>(shift[static_cast<Eigen::Index>(axis)]);
  }
  double off_m = 0.0;
  for (std::size_t f = 0; f < feet.size(); ++f) {
    off_m = std::max(off_m, (feet[f] + shift - places_m[f]).norm());
  }
  return off_m;
}

}  // namespace

Result<BodyPerformance> perform_on(const gesture::GestureModel& model,
                                   const Performance& performance, const clip::Clip& body) {
  if (model.is_hand()) return misuse("the model is of hands, which have no body to perform on");
  const auto space = motion::PoseSpace::bind(*model.body, *body.skeleton);
  if (!space) return std::unexpected(space.error());
  if (body.frames() == 0) return fail("has no frame to stand in", body.path);
  const Frame first = body.frame(0);
  const double heading_rad =
      motion::walk_heading_rad({body.skeleton, performance.rate_hz, {first}});
  const std::vector<Vector3d> places_m = feet_m(*body.skeleton, first);
  const auto dims = static_cast<std::size_t>(space->dims());
  std::vector<float> q(dims), change(dims);
  std::vector<std::uint8_t> available(dims);
  space->to_vector(first, heading_rad, q, available);
  BodyPerformance out;
  clip::FramesClip frames(body.skeleton);
  std::vector<double> time_s;
  for (const Pose& pose : performance.angles) {
    for (std::size_t d = 0; d < dims; ++d) change[d] = static_cast<float>(pose[d]) - q[d];
    Frame frame = first;
    space->add(frame, heading_rad, q, change);
    out.feet_off_m = std::max(out.feet_off_m, stand(*body.skeleton, places_m, frame));
    frames.add(frame);
    time_s.push_back(static_cast<double>(time_s.size()) / performance.rate_hz);
  }
  auto clip = frames.finish(body.path, performance.rate_hz, std::move(time_s));
  if (!clip) return std::unexpected(clip.error());
  out.clip = std::move(*clip);
  out.clip.metres_per_unit = body.metres_per_unit;
  return out;
}

}  // namespace posed::perform
