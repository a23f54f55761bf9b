// A robot hand as its URDF text describes it: links in tree order with the joints that carry them.
// The text is not trusted: what is not a plausible hand is refused by a sentence. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "models/robot/hull.hpp"
#include "proto/frame/result.hpp"

namespace posed::robot {

inline constexpr std::size_t kMaxUrdfBytes = std::size_t{4} << 20;
inline constexpr int kMaxUrdfLinks = 1000;

struct Shape {
  enum class Kind : std::uint8_t { kBox, kCylinder, kCapsule, kSphere };
  Kind kind = Kind::kBox;
  // A box's edges; else x: the radius, y: the length along z, of a capsule without its caps.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();  // in the link's frame
  Hull hull;  // of the mesh that a capsule holds, in the same frame; else without corners
};

// A link and the joint that carries it. Angles in rad; a follower's are those of the file.
struct Link {
  std::string name;
  std::string joint;                                     // empty: the root
  int parent = -1;                                       // an earlier link
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();  // in the parent's frame, at zero
  bool turns = false;
  bool slides = false;   // or moves in another way: it stands at zero
  bool endless = false;  // a "continuous" joint: its limits are half a turn to each side
  // Its <limit> has neither lower nor upper: both are zero, as URDF says; a follower's are half a
  // turn to each side, because zero would pin its leader.
  bool unlimited = false;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // unit length, in its own frame
  double low = 0.0, high = 0.0;
  double speed = 0.0;  // rad/s; 0: the file names none
  // Angle = multiplier * angle of the link `leader` + offset; -1: none. The leader follows nobody:
  // chains are resolved.
  int leader = -1;
  double multiplier = 1.0, offset = 0.0;
  std::vector<Shape> shapes;
  std::vector<std::string> unused_meshes;  // of each that has no shape: why
};

struct Urdf {
  std::string name;
  bool by_visuals = false;  // it has no collision shapes: its visuals stand for them
  // A parent before its children, which are in the order of the file (depth first).
  std::vector<Link> links;
};

// `file` is named in errors.
Result<Urdf> parse_urdf(std::string_view text, const std::string& file);

// The text of a file without what kinematics do not need (visuals, inertia), and with its collision
// meshes (.stl, .obj) replaced by capsules that hold all their corners, and by <hull> beside them,
// so that the text says all. A mesh that is not used says why.
Result<std::string> load_urdf(const std::string& path);

// The rotation of a URDF's roll, pitch and yaw [rad]: about the fixed x, then y, then z.
[[nodiscard]] inline Eigen::Matrix3d turn_of_rpy(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace posed::robot
