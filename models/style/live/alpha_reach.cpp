#include "models/style/live/alpha_reach.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "models/motion/kinematics.hpp"
#include "models/style/live/bound_model.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {
namespace {

using Eigen::Vector3d;

constexpr int kSteps = 10;  // of alpha, in 1
constexpr int kMaxWhole = static_cast<int>(kMaxAlpha);
constexpr int kEvery = 2;              // points of the cycle
constexpr double kTolerance_m = 0.01;  // deeper than this counts

// Sizes in widths of the shoulders, from joint to joint. On an adult, where these are 36 cm apart,
// the head is 20 cm thick, the trunk 22 cm, the forearm 7 cm, and the fingers reach 9 cm beyond the
// wrist when they are bent.
constexpr double kHeadUp = 0.30, kHeadRadius = 0.28, kTrunkRadius = 0.30, kArmRadius = 0.10;
constexpr double kHandLength = 0.25;

// Every canonical local rotation is the identity: L = T_parent^-1 T_joint.
Frame t_pose(const Skeleton& skeleton) {
  Frame frame;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const Eigen::Quaterniond parent =
        joint.parent < 0 ? Eigen::Quaterniond::Identity()
                         : skeleton.joints[static_cast<std::size_t>(joint.parent)].T_world_joint;
    frame.valid[j] = true;
    frame.rotation_xyzw[j] = from_eigen(parent.conjugate() * joint.T_world_joint);
  }
  return frame;
}

// The joints that are tried.
struct ArmsAndBody {
  struct Arm {
    int elbow = -1, hand = -1;
  };
  std::array<Arm, 2> arms;
  int hips = -1, neck = -1, head = -1;
  double shoulders_m = 0.0;

  static std::optional<ArmsAndBody> of(const Skeleton& skeleton) {
    const auto joint = [&](Bone bone) { return skeleton.joint_of(bone); };
    ArmsAndBody body{.arms = {{{joint(Bone::kLeftLowerArm), joint(Bone::kLeftHand)},
                               {joint(Bone::kRightLowerArm), joint(Bone::kRightHand)}}},
                     .hips = joint(Bone::kHips),
                     .neck = joint(Bone::kNeck),
                     .head = joint(Bone::kHead)};
    if (body.neck < 0) body.neck = body.head;
    const int left = joint(Bone::kLeftUpperArm);
    const int right = joint(Bone::kRightUpperArm);
    const bool complete = left >= 0 && right >= 0 && body.hips >= 0 && body.head >= 0 &&
                          std::ranges::all_of(body.arms, [](const Arm& arm) {
                            return arm.elbow >= 0 && arm.hand >= 0;
                          });
    if (!complete) return std::nullopt;
    const motion::WorldPose rest = motion::world_pose(skeleton, t_pose(skeleton));
    body.shoulders_m = (rest.position_m[static_cast<std::size_t>(left)] -
                        rest.position_m[static_cast<std::size_t>(right)])
                           .norm();
    return body;
  }

  // How deep an arm is in the head or the trunk [m]; at most 0: in neither.
  [[nodiscard]] double depth_m(const Skeleton& skeleton, const Frame& frame) const {
    const motion::WorldPose pose = motion::world_pose(skeleton, frame);
    const auto at = [&](int j) { return pose.position_m[static_cast<std::size_t>(j)]; };
    const auto h = static_cast<std::size_t>(head);
    const Vector3d up =
        pose.rotation[h] * (skeleton.joints[h].T_world_joint.conjugate() * Vector3d::UnitY());
    const Vector3d skull = at(head) + kHeadUp * shoulders_m * up;
    double depth = -1.0;
    for (const Arm& arm : arms) {
      const Vector3d along = (at(arm.hand) - at(arm.elbow)).normalized();
      const Vector3d tip = at(arm.hand) + kHandLength * shoulders_m * along;
      for (int i = 1; i <= 4; ++i) {  // not the elbow, which the upper arm holds beside the body
        const Vector3d point = at(arm.elbow) + i / 4.0 * (tip - at(arm.elbow));
        const double from_head = (point - skull).norm() - kHeadRadius * shoulders_m;
        const double from_trunk =
            from_segment_m(point, at(hips), at(neck)) - kTrunkRadius * shoulders_m;
        depth = std::max(depth, kArmRadius * shoulders_m - std::min(from_head, from_trunk));
      }
    }
    return depth;
  }

  static double from_segment_m(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
    const Vector3d along = b - a;
    const double t =
        std::clamp(along.dot(point - a) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
    return (point - a - t * along).norm();
  }
};

// The walk of training on the figure, at some of its points, and what a style adds there.
class StyledWalk {
 public:
  explicit StyledWalk(const BoundModel& model) : model_(model) {
    const auto dims = static_cast<std::size_t>(model.space.dims());
    for (int i = 0; i < kGridFrames; i += kEvery) {
      Point& point = points_.emplace_back();
      point.frame = t_pose(model.space.skeleton());
      std::vector<double> q(dims);
      for (std::size_t d = 0; d < dims; ++d) {
        q[d] = model.anyone->cycle(i, static_cast<Eigen::Index>(d));
      }
      model.space.put(point.frame, 0.0, q);
      point.q.resize(dims);
      point.available.resize(dims);
      model.space.to_vector(point.frame, 0.0, point.q, point.available);
    }
  }

  void choose(std::size_t style) {
    std::vector<float> shares(model_.styles().size(), 0.0F);
    shares[style] = 1.0F;
    for (Point& point : points_) {
      point.change.resize(static_cast<std::size_t>(model_.predictor.outputs()));
      model_.predictor.mean(point.q, point.available, point.change, shares);
      point.change.resize(point.q.size());
    }
  }

  // The deepest point of the cycle.
  [[nodiscard]] double depth_m(const ArmsAndBody& body, double alpha) const {
    double depth = -1.0;
    std::vector<float> change;
    for (const Point& point : points_) {
      change = point.change;
      for (float& value : change) value *= static_cast<float>(alpha);
      Frame frame = point.frame;
      model_.space.add(frame, 0.0, point.q, change);
      model_.hinges.hold(point.frame.rotation_xyzw, frame);
      depth = std::max(depth, body.depth_m(model_.space.skeleton(), frame));
    }
    return depth;
  }

 private:
  struct Point {
    Frame frame;
    std::vector<float> q, change;
    std::vector<std::uint8_t> available;
  };
  const BoundModel& model_;
  std::vector<Point> points_;
};

// The last alpha from `from` towards `to` at which arms are no deeper than `allowed_m`; a whole
// number of steps, so that it is the very number that was asked for.
double last_free(const StyledWalk& walk, const ArmsAndBody& body, int from, int to,
                 double allowed_m) {
  const int sign = to < from ? -1 : 1;
  const auto alpha = [](int whole) { return static_cast<double>(whole) / kSteps; };
  int step = from * kSteps;
  while (step != to * kSteps && walk.depth_m(body, alpha(step + sign)) <= allowed_m) step += sign;
  return alpha(step);
}

}  // namespace

std::vector<AlphaReach> alpha_reach(const BoundModel& model) {
  std::vector<AlphaReach> reach(model.styles().size());
  const auto body = ArmsAndBody::of(model.space.skeleton());
  if (!model.anyone || !body) return reach;
  StyledWalk walk(model);
  for (std::size_t s = 0; s < reach.size(); ++s) {
    walk.choose(s);
    const double unstyled_m = std::max(0.0, walk.depth_m(*body, 0.0));
    const double trained_m = std::max(unstyled_m, walk.depth_m(*body, 1.0));
    reach[s].high = last_free(walk, *body, 1, kMaxWhole, trained_m + kTolerance_m);
    reach[s].low = last_free(walk, *body, 0, -kMaxWhole, unstyled_m + kTolerance_m);
  }
  return reach;
}

}  // namespace posed::style
