// The one recogniser of skeletons: which joint is which bone of a person, what its T frame is,
// which axis is up and how long a unit is, from the names, the zero pose and, where that is folded,
// some poses of a clip. It serves clips and live skeletons; a profile's or a driver's word goes
// before its own. Cold; the work is bounded for any input.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/humanoid.hpp"
#include "proto/rig/figure.hpp"
#include "proto/rig/t_frames.hpp"
#include "proto/rig/up.hpp"

namespace posed::rig {

struct RigInput {
  std::vector<RigJoint> joints;  // parents first, one root; not checked here
  RigPoses poses;                // may be empty
  // What is known already; each replaces the recogniser's own finding.
  std::vector<std::optional<Bone>> bones;            // [joint]; empty: not known
  std::vector<std::optional<Eigen::Quaterniond>> T;  // [joint], in the file's axes; may be empty
  std::optional<UpAxis> up;
  std::optional<Eigen::Vector3d> facing;  // the axis of the file that the zero pose faces
  std::optional<double> metres_per_unit;
  // By the format lengths are metres and +Y is up. Another unit is found only where a person would
  // be eight times too large or too small, another axis only where the zero pose stands along it.
  bool format_says = false;
};

struct Rig {
  Kind kind = Kind::kPart;
  std::vector<std::optional<Bone>> bone;  // [joint]
  // [joint]: its world rotation in the canonical T-pose, from its zero frame in the file's axes.
  std::vector<Eigen::Quaterniond> T;
  std::vector<Evidence> evidence;  // [joint] of T; empty for joints that are no bones
  UpAxis up = UpAxis::kPlusY;
  std::string why_up;
  std::string facing;  // "+z": the axis that the zero pose faces; empty when it is no person
  std::string why_facing;
  // Empty when nothing tells the unit: the figure is no person, and none was given.
  std::optional<double> metres_per_unit;
  std::string unit;  // "cm", for sentences
  std::string why_unit;
  std::vector<std::string> notes;  // sentences about what is not sure
};

[[nodiscard]] Rig recognise(const RigInput& input);

}  // namespace posed::rig
