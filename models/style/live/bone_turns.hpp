// BoneTurns: gives a walker of another build the change of a style (models/style/README.md, "Other
// builds"). What the style does to the walk of training is carried over as turns of bones in the
// world, for arms as a change of their direction, because the same angles of joints bring an arm
// that hangs another way to another place. Const and shareable; RT-safe after make().
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "models/motion/pose_space.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::style {

// Where each joint lies on the way from the hips (0) to the head (1), by the lengths of the bones;
// -1 aside of it. Cold.
[[nodiscard]] std::vector<double> trunk_places(const Skeleton& skeleton);

class BoneTurns {
 public:
  // Empty for a space other than humanoid. `skeleton` has the bones of a person; `places` [joints
  // of the spec] are GateData::places, without which trunks are matched by the names of their
  // bones.
  static std::optional<BoneTurns> make(const motion::PoseSpaceSpec& spec,
                                       std::span<const double> places, const Skeleton& skeleton);

  // Turns the joints of `frame` as the bones turn from the pose `from` of training to
  // from + change [rad, dims]. `shares` [dims] is how far a bone takes part: at 0 it rides on the
  // bone above it. Joints that were not measured stay.
  RT_SAFE void add(Frame& frame, double heading_rad, std::span<const float> from,
                   std::span<const float> change, std::span<const float> shares) const noexcept;

 private:
  // Of the training's figure.
  struct Taught {
    int parent = -1;  // among these
    int first_dim = 0;
    Eigen::Quaterniond mean;
  };
  // Of the walker's.
  struct Part {
    int bone = -1;  // among the taught ones: whose share counts
    bool rides = true;
    // The taught bones whose turns it gets, each by a share of 1; mostly the one of its name.
    std::vector<std::pair<int, double>> turns_as{};
    bool gives_back = false;  // what the neck turns more than by its place
    // An arm's direction in its joint's frame, and in the T-pose.
    std::optional<Eigen::Vector3d> along{};
    Eigen::Vector3d in_t_pose = Eigen::Vector3d::Zero();
  };
  using Turns = std::array<Eigen::Quaterniond, kMaxJoints>;

  BoneTurns() = default;
  void match_trunk(const std::vector<std::pair<double, int>>& taught);
  RT_SAFE void find_taught(std::span<const float> from, std::span<const float> change,
                           Turns& before, Turns& after) const noexcept;
  RT_SAFE [[nodiscard]] Eigen::Quaterniond turn_of(const Part& part, const Eigen::Quaterniond& own,
                                                   const Eigen::Vector3d& back, const Turns& before,
                                                   const Turns& after) const noexcept;
  RT_SAFE [[nodiscard]] Eigen::Vector3d back_of(const Frame& frame, std::span<const float> shares,
                                                const Turns& before,
                                                const Turns& after) const noexcept;
  RT_SAFE [[nodiscard]] double share_of(const Part& part,
                                        std::span<const float> shares) const noexcept;

  Skeleton skeleton_;
  std::vector<Taught> taught_;  // the one above before the one below
  std::vector<Part> parts_;     // [joint]
  int neck_ = -1;               // the joint, where it turns more than by its place
  // The taught bones whose turns the trunk gives back, by shares with a sum of 0.
  std::vector<std::pair<int, double>> gives_back_;
};

}  // namespace posed::style
