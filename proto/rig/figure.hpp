// What the recogniser looks at: the joints of any figure, and some of its poses.
//
// Shapes: joints have their parents before them; there is one root, joint 0. Lengths are in the
// file's unit, axes are the file's. Cold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "proto/rig/directions.hpp"

namespace posed::rig {

// Poses beyond these are not looked at, whatever the clip's length.
inline constexpr int kMaxPoses = 600;
inline constexpr int kMaxPoseJoints = 300'000;  // poses x joints

struct RigJoint {
  std::string name;
  int parent = -1;
  Vec offset = Vec::Zero();  // in the parent's frame
  std::optional<Vec> end_site;
};

// Parent-relative rotations and positions [pose x joint] of evenly chosen frames of a clip.
struct RigPoses {
  int count = 0;
  std::vector<Eigen::Quaterniond> rotation;
  std::vector<Vec> position;
};

// The tree of the joints, with what is asked of it again and again.
class Figure {
 public:
  explicit Figure(std::vector<RigJoint> joints);

  [[nodiscard]] int size() const { return static_cast<int>(joints_.size()); }
  [[nodiscard]] const RigJoint& operator[](int joint) const { return joints_[joint]; }
  [[nodiscard]] const std::vector<int>& children(int joint) const { return children_[joint]; }
  // Number of joints from the root to this one, both counted.
  [[nodiscard]] int depth(int joint) const { return depth_[joint]; }
  [[nodiscard]] double end_length(int joint) const;

  // True when `joint` is `top` or lies below it.
  [[nodiscard]] bool below(int top, int joint) const {
    return begin_[joint] >= begin_[top] && begin_[joint] < end_[top];
  }
  // The joints from the root to `joint`.
  [[nodiscard]] std::vector<int> path(int joint) const;
  // The lowest joint that is above or at all of them; the root for none.
  [[nodiscard]] int common(const std::vector<int>& joints) const;
  // From `top` to `joint` in the zero pose; empty when that does not lie below it.
  [[nodiscard]] std::optional<Vec> between(int top, int joint) const;

  // The joint, then always the child with the longest way to a tip below it.
  [[nodiscard]] std::vector<int> main_chain(int joint) const;
  [[nodiscard]] int main_child(int joint) const { return main_child_[joint]; }
  [[nodiscard]] int main_chain_length(int joint) const { return chain_length_[joint]; }
  // The longest way to a tip below the joint.
  [[nodiscard]] double reach(int joint) const { return reach_[joint]; }
  // Lengths of the segments that begin at the joints of a main chain; the last is its end site's.
  [[nodiscard]] std::vector<double> segments(const std::vector<int>& chain) const;

 private:
  std::vector<RigJoint> joints_;
  std::vector<std::vector<int>> children_;
  std::vector<int> depth_, begin_, end_, main_child_, chain_length_;
  std::vector<double> reach_;
};

}  // namespace posed::rig
