// RobotHand: what posed derives from a URDF, so that nobody has to type it: which joints are
// driven, follow or stand, their limits, the fingers, the palm's frame, and capsules that hold each
// link's collision shapes. Built cold, then constant; place() and slope() are RT-safe.
// models/robot/README.md has the definitions.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/robot/urdf.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/rt_safe.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::robot {

inline constexpr int kMaxDriven = 24;

using Drive = Eigen::Matrix<double, kMaxDriven, 1>;  // [driven joint]; zero behind the last one

struct RobotOptions {
  std::string tips{};           // names of links, thumb first; empty: derived
  std::string hold{};           // "joint=rad, ...": these stand
  std::string start{};          // "joint=rad, ...": the first command; else zero within the limits
  double speed = 0.0;           // rad/s, 0: 8; or what the URDF says where that is less
  double acceleration = 120.0;  // rad/s^2
  // Of the hand that drives it, and of several the one that is driven; empty: as the URDF bends, of
  // several the right one.
  std::optional<Side> side{};
  bool needs_speeds = true;  // false: to be looked at only
};

// A joint that turns, in the order of Frame::angle_rad.
struct RobotJoint {
  int link = 0;  // that it carries
  std::string name;
  double low = 0.0, high = 0.0;  // rad, both are floats
  double speed = 0.0;            // rad/s; 0: unknown, and it was not needed
  int driven = -1;  // angle = multiplier * drive[driven] + offset; -1: stands at offset
  double multiplier = 1.0, offset = 0.0;
  bool follows = false;
};

// A joint that the hand drives, with what those that follow it leave of its limits.
struct DrivenJoint {
  int joint = 0;
  double low = 0.0, high = 0.0, start = 0.0;  // rad
  double open = 0.0;                          // rad, of the open hand
  double speed = 0.0, acceleration = 0.0;     // rad/s, rad/s^2
};

struct Finger {
  int human = 0;    // which finger drives it: 0 is the thumb
  int base = 0;     // link of its first joint
  int knuckle = 0;  // link of the joint from which its length is measured
  int last = 0;     // link of its last joint
  int tip = 0;      // link at its end
  Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();  // in that one's frame
  bool tip_known = false;  // else it has neither a link nor a shape beyond its last joint
  double length_m = 0.0;   // along the chain
  double tip_radius_m = 0.0;
  bool tip_shaped = false;                              // else the radius is a guess
  Eigen::Vector3d knuckle_m = Eigen::Vector3d::Zero();  // in the root's frame, when open
};

struct Capsule {
  int link = 0;
  int shape = 0;                                     // of RobotHand::balls
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();  // in the link's frame
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
  double per_m2 = 0.0;  // 1 / length^2; 0: a ball
};

struct Ball {  // that holds the capsules of a shape, in the link's frame
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  double reach_m = 0.0;
  int first = 0, count = 0;  // its capsules
};

struct Cover {  // the capsule that holds all those of a link, in its frame
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double radius_m = 0.0, per_m2 = 0.0;
  int first = 0, count = 0;              // its capsules; none: the link has no shape
  int first_shape = 0, shape_count = 0;  // its balls and hulls
};

// Two links that are kept apart: by their capsules, or where those touch when open by some of the
// hulls of their shapes.
struct LinkPair {
  int a = 0, b = 0;
  int first = 0, count = 0;  // of RobotHand::hull_pairs; none: by capsules
};

struct CoverPose {  // of a link's cover in some frame
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero(), to_m = Eigen::Vector3d::Zero();
};
// The most that any of its points has gone between two poses.
RT_SAFE [[nodiscard]] double most_way_m(const Cover& cover, const CoverPose& then,
                                        const CoverPose& now) noexcept;

struct Turn {  // of a link by a driven joint above it
  int link = 0, driven = 0;
  double multiplier = 1.0;
  double swing_m = 0.0;  // the link's farthest point from the axis in any pose, by the multiplier
};

struct RobotHand {
  std::string name;
  std::string chosen;  // of a robot that is more than a hand: a line that says which part it is
  std::vector<std::string> remarks;  // what the URDF leaves open, and how it was taken
  bool by_visuals = false;           // as Urdf says
  Side side = Side::kRight;
  bool either_side = false;  // its fingers face the thumb in the middle: it serves for both
  std::vector<Link> links;
  std::vector<RobotJoint> joints;
  std::vector<DrivenJoint> driven;
  std::vector<Finger> fingers;  // thumb first, then from its side on
  // Columns: out of the palm, to the thumb's side, to the fingers. A left hand's is a mirror image.
  Eigen::Matrix3d palm = Eigen::Matrix3d::Identity();
  std::vector<Capsule> capsules;                // by link
  std::vector<double> reach_m;                  // [capsule], radius of the ball around it
  std::vector<Cover> covers;                    // [link]
  std::vector<Ball> balls;                      // of shapes, by link
  std::vector<Hull> hulls;                      // the same
  std::vector<std::pair<int, int>> hull_pairs;  // by pair of links
  std::vector<LinkPair> pairs;                  // of links that must not touch
  std::vector<std::pair<int, int>> left_out;    // some of whose shapes touch anyway
  std::vector<std::vector<Turn>> turns;         // [link]
  std::vector<int> joint_of_link;               // [link]; -1: it does not turn

  [[nodiscard]] int size() const noexcept { return static_cast<int>(driven.size()); }
  [[nodiscard]] Drive start() const;
};

// An error says why this is no hand that posed can drive. The links are those of a parsed URDF.
Result<RobotHand> robot_hand(Urdf urdf, const RobotOptions& options, const std::string& file);

// The robot as a skeleton: a joint a link, in tree order, Y up, and a channel a joint that turns.
Result<Skeleton> robot_skeleton(const RobotHand& hand);

// All links in one pose, in the root's frame; and, with capsules, what makes finding gaps cheap.
struct Placed {
  explicit Placed(std::size_t links) : turn(links), at_m(links), axis(links) {}
  explicit Placed(const RobotHand& hand);  // with capsules

  Drive drive = Drive::Constant(std::numeric_limits<double>::quiet_NaN());  // none yet
  std::vector<Eigen::Matrix3d> turn;
  std::vector<Eigen::Vector3d> at_m;
  std::vector<Eigen::Vector3d> axis;  // of the joint that carries the link

  // How far any point of a link has gone since the first pose, at most: what two links have gone
  // is the most that their gap has shrunk.
  std::vector<double> way_m;                            // [link]
  std::vector<CoverPose> cover;                         // [link]
  std::vector<Eigen::Vector3d> from_m, to_m, middle_m;  // [capsule] of shapes that are shown
  std::vector<char> shown;                              // [shape]
  std::vector<double> swing_m;                          // scratch: [link]
  struct NearShape {
    int first = 0, count = 0;  // of `near`
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
    double reach_m = 0.0;
  };
  std::vector<NearShape> near_shapes;  // scratch
  std::vector<int> near;               // scratch: capsules
  struct Least {
    double gap_m = -1.0, way_m = 0.0;  // when both together had gone that way
  };
  std::vector<Least> least;  // [pair of RobotHand::pairs]
  // Of two links that hulls keep apart: how far the second one has gone as the first one sees it,
  // since the first pose, and the hulls that were nearest.
  struct ByHulls {
    double way_m = 0.0;
    int nearest = 0;
    CoverPose seen;
  };
  std::vector<ByHulls> by_hulls;       // [pair of RobotHand::pairs]
  std::vector<Least> hulls;            // [pair of hulls], by that way
  std::vector<Eigen::Vector3d> apart;  // [pair of hulls], as the first link sees it
  // The capsules of two links that were nearest to each other when all were last looked at, the
  // nearest first. All others were farther than `others_m`. Where the second link's cover was then,
  // as the first one sees it.
  struct Close {
    static constexpr std::size_t kMaxPairs = 12;
    struct Two {
      double gap_m = 0.0;
      int a = 0, b = 0;
    };
    std::array<Two, kMaxPairs> two;
    std::size_t count = 0;
    double others_m = -1.0;
    CoverPose seen;

    [[nodiscard]] double least_m() const noexcept { return count > 0 ? two[0].gap_m : others_m; }
  };
  std::vector<Close> close;  // [link * links + link]
};
RT_SAFE [[nodiscard]] double angle_of(const RobotJoint& joint, const Drive& drive) noexcept;
RT_SAFE void place(const RobotHand& hand, const Drive& drive, Placed& placed) noexcept;
RT_SAFE inline Eigen::Vector3d tip_of(const Finger& finger, const Placed& placed) noexcept {
  return placed.at_m[finger.tip] + placed.turn[finger.tip] * finger.tip_m;
}
// Adds to `slope` how much `point_m`, fixed to `link`, moves along `direction` [m/rad].
RT_SAFE void add_slope(const RobotHand& hand, const Placed& placed, int link,
                       const Eigen::Vector3d& point_m, const Eigen::Vector3d& direction,
                       Drive& slope) noexcept;

}  // namespace posed::robot
