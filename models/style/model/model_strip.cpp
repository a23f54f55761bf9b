#include "models/style/model/model_strip.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "models/gp/regression.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/humanoid.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;

constexpr double kCentimetres = 100.0;
constexpr int kGround_cm = 180;            // below the top of the drawing
constexpr double kMaxPlace_cm = 20'000.0;  // of a place in it; a broken model's may be anywhere

// The lines of a figure, each from joint to joint.
const std::vector<std::vector<Bone>>& limbs() {
  static const std::vector<std::vector<Bone>> all{
      {Bone::kHips, Bone::kChest, Bone::kNeck, Bone::kHead},
      {Bone::kNeck, Bone::kLeftUpperArm, Bone::kLeftLowerArm, Bone::kLeftHand},
      {Bone::kNeck, Bone::kRightUpperArm, Bone::kRightLowerArm, Bone::kRightHand},
      {Bone::kHips, Bone::kLeftLowerLeg, Bone::kLeftFoot, Bone::kLeftToes},
      {Bone::kHips, Bone::kRightLowerLeg, Bone::kRightFoot, Bone::kRightToes}};
  return all;
}

// Poses of the style [kStripPoses x dims]: the mean cycle of everybody it was learnt from, and what
// the style makes of it. Empty: not known.
MatrixXd cycle_of(const StyleModel& model, int dims) {
  if (model.gate.usual.empty()) return {};
  MatrixXd mean = MatrixXd::Zero(kCycleRows, dims);
  for (const MatrixXd& one : model.gate.usual) {
    if (one.rows() != mean.rows() || one.cols() != mean.cols()) return {};
    mean += one / static_cast<double>(model.gate.usual.size());
  }
  const MatrixXd grid = grid_basis() * mean;
  MatrixXd poses(kStripPoses, dims);
  for (int i = 0; i < kStripPoses; ++i) {
    poses.row(i) = grid.row(i * static_cast<int>(grid.rows()) / kStripPoses);
  }
  if (model.process.inputs.cols() != dims) return {};
  const MatrixXd change = gp::posterior_mean(model.process, poses);
  if (change.cols() < dims) return {};
  return poses + change.leftCols(dims);
}

const Eigen::Vector3d* place_of(const Skeleton& figure, const motion::WorldPose& pose, Bone bone) {
  const int joint = figure.joint_of(bone);
  return joint < 0 ? nullptr : &pose.position_m[static_cast<std::size_t>(joint)];
}

// Where the figure faces over all poses, level; a skeleton of its own may face anywhere.
Eigen::Vector3d forward_of(const Skeleton& figure, const std::vector<motion::WorldPose>& poses) {
  Eigen::Vector3d left = Eigen::Vector3d::Zero();
  for (const motion::WorldPose& pose : poses) {
    const auto* const to = place_of(figure, pose, Bone::kLeftUpperLeg);
    const auto* const from = place_of(figure, pose, Bone::kRightUpperLeg);
    if (to != nullptr && from != nullptr) left += *to - *from;
  }
  const Eigen::Vector3d forward(-left.z(), 0.0, left.x());  // left x up
  return forward.norm() > 0.0 ? Eigen::Vector3d(forward.normalized()) : Eigen::Vector3d::UnitZ();
}

void draw(const Skeleton& figure, const motion::WorldPose& pose, const Eigen::Vector3d& forward,
          int left_cm, std::string& path) {
  const Eigen::Vector3d* const hips = place_of(figure, pose, Bone::kHips);
  if (hips == nullptr) return;
  double lowest_m = hips->y();
  for (const Eigen::Vector3d& joint : pose.position_m) lowest_m = std::min(lowest_m, joint.y());
  const auto whole = [](double value) {
    return std::isfinite(value)
               ? static_cast<int>(std::lround(std::clamp(value, -kMaxPlace_cm, kMaxPlace_cm)))
               : 0;
  };
  for (const auto& limb : limbs()) {
    char pen = 'M';
    for (const Bone bone : limb) {
      const Eigen::Vector3d* const joint = place_of(figure, pose, bone);
      if (joint == nullptr) continue;
      fmt::format_to(std::back_inserter(path), "{}{} {}", pen,
                     left_cm + whole(kCentimetres * (*joint - *hips).dot(forward)),
                     kGround_cm - whole(kCentimetres * (joint->y() - lowest_m)));
      pen = 'L';
    }
  }
}

// Who is drawn, in no pose yet; null: the model does not say how its figures look.
std::shared_ptr<const Skeleton> figure_of(const StyleModel& model,
                                          std::span<const std::shared_ptr<const Skeleton>> known) {
  const auto walker = motion::make_walker({.seconds = 1.0});
  if (walker && model.space.space == motion::Space::kHumanoid) return walker->skeleton;
  const auto learnt_from = [&](const std::shared_ptr<const Skeleton>& figure) {
    return figure && std::ranges::find(model.gate.rigs, rig_id(*figure)) != model.gate.rigs.end();
  };
  const auto found = std::ranges::find_if(known, learnt_from);
  if (found != known.end()) return *found;
  return walker && learnt_from(walker->skeleton) ? walker->skeleton : nullptr;
}

Frame at_rest(const Skeleton& figure) {
  Frame frame;
  frame.skeleton = figure.id;
  frame.joint_count = static_cast<std::uint16_t>(figure.joints.size());
  for (std::size_t j = 0; j < figure.joints.size(); ++j) frame.valid.set(j);
  return frame;
}

}  // namespace

std::string strip_of(const StyleModel& model,
                     std::span<const std::shared_ptr<const Skeleton>> known) {
  const auto figure = figure_of(model, known);
  if (!figure) return {};
  const auto space = motion::PoseSpace::bind_person(model.space, *figure);
  if (!space) return {};
  const MatrixXd cycle = cycle_of(model, space->dims());
  std::vector<motion::WorldPose> poses;
  for (int i = 0; i < static_cast<int>(cycle.rows()); ++i) {
    Frame frame = at_rest(*figure);
    const Eigen::VectorXd q = cycle.row(i);
    space->put(frame, 0.0, {q.data(), static_cast<std::size_t>(q.size())});
    poses.push_back(motion::world_pose(*figure, frame));
  }
  const Eigen::Vector3d forward = forward_of(*figure, poses);
  std::string path;
  for (int i = 0; i < static_cast<int>(poses.size()); ++i) {
    draw(*figure, poses[static_cast<std::size_t>(i)], forward,
         kStripPose_cm * i + kStripPose_cm / 2, path);
  }
  return path;
}

}  // namespace posed::style
