// Legs: which joints of a skeleton are its legs, and where their feet are in a frame
// (models/feet/README.md, "Points of a foot").
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::feet {

inline constexpr std::size_t kLegs = 2;          // left, right
inline constexpr double kReferenceLeg_m = 0.83;  // an adult's

// The points of a foot that can touch the ground. A skeleton may lack the toe or its tip.
enum Point : std::size_t { kAnkle, kToe, kTip, kPoints };

// A value for each point of each leg.
template <typename T>
using OfPoints = std::array<std::array<T, kPoints>, kLegs>;

// World rotations of the joints that carry a leg, and the places of its points.
struct LegPose {
  // [joint]; set for the joints of `Legs::joints` only.
  std::array<Eigen::Quaterniond, kMaxJoints> world_rotation;
  std::array<Eigen::Vector3d, kMaxJoints> from_root_m;  // world axes, from the root joint
  OfPoints<Eigen::Vector3d> point_from_root_m;
  std::array<bool, kLegs> measured{};  // all joints from the hips to the foot
};

struct Leg {
  int thigh = -1, shin = -1, foot = -1;  // joints
  double thigh_m = 0.0, shin_m = 0.0;
  // Where a point is fixed: a joint and a place in its frame. No joint: there is no such point.
  struct Place {
    int joint = -1;
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  };
  std::array<Place, kPoints> points{};
  std::vector<int> chain{};  // joints that must be measured, from the top of the skeleton on

  [[nodiscard]] bool exists() const noexcept { return foot >= 0; }
  [[nodiscard]] bool has(std::size_t point) const noexcept { return points[point].joint >= 0; }
};

class Legs {
 public:
  // Finds the legs by the canonical bones of the joints. One leg is enough; none is an error that
  // says which bones are missing. Cold.
  static Result<Legs> find(const Skeleton& skeleton);

  RT_SAFE void pose(const Frame& frame, LegPose& pose) const noexcept;

  [[nodiscard]] const Leg& leg(std::size_t index) const noexcept { return legs_[index]; }
  // Thigh and shin of the longer leg [m].
  [[nodiscard]] double length_m() const noexcept { return length_m_; }
  // That length over kReferenceLeg_m; speeds and lengths scale with it.
  [[nodiscard]] double scale() const noexcept { return length_m_ / kReferenceLeg_m; }

 private:
  struct Link {
    int joint = 0, parent = -1;
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  };

  std::array<Leg, kLegs> legs_;
  std::vector<Link> joints_;  // those that carry a leg, parents first
  int root_ = 0;
  double length_m_ = 0.0;
};

}  // namespace posed::feet
