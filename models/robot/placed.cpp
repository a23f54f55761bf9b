#include <algorithm>
#include <cmath>

#include "models/robot/robot_hand.hpp"

namespace posed::robot {

Placed::Placed(const RobotHand& hand)
    : turn(hand.links.size(), Eigen::Matrix3d::Identity()),
      at_m(hand.links.size(), Eigen::Vector3d::Zero()),
      axis(hand.links.size(), Eigen::Vector3d::UnitX()),
      way_m(hand.links.size()),
      cover(hand.links.size()),
      from_m(hand.capsules.size()),
      to_m(hand.capsules.size()),
      middle_m(hand.capsules.size()),
      shown(hand.balls.size()),
      swing_m(hand.links.size()),
      near_shapes(hand.balls.size()),
      near(hand.capsules.size()),
      least(hand.pairs.size()),
      by_hulls(hand.pairs.size()),
      hulls(hand.hull_pairs.size()),
      apart(hand.hull_pairs.size(), Eigen::Vector3d::UnitX()),
      close(hand.links.size() * hand.links.size()) {}

double angle_of(const RobotJoint& joint, const Drive& drive) noexcept {
  return joint.driven < 0 ? joint.offset : joint.multiplier * drive[joint.driven] + joint.offset;
}

// The way of a point is linear in its place, so that of a capsule's points is longest at an end,
// and further by what the turn adds within its radius. The two singular values of a difference of
// rotations are the same, the third is zero.
double most_way_m(const Cover& cover, const CoverPose& then, const CoverPose& now) noexcept {
  const double end_m = std::sqrt(
      std::max((now.from_m - then.from_m).squaredNorm(), (now.to_m - then.to_m).squaredNorm()));
  return end_m + cover.radius_m * std::sqrt(0.5) * (now.turn - then.turn).norm();
}

namespace {

RT_SAFE void move_cover(const Cover& cover, int link, Placed& placed) noexcept {
  constexpr double kFar_m = 1e3;  // also for what is no number: whatever was known is void
  const Eigen::Matrix3d& turn = placed.turn[link];
  const CoverPose now{.turn = turn,
                      .from_m = placed.at_m[link] + turn * cover.from_m,
                      .to_m = placed.at_m[link] + turn * cover.to_m};
  const double way_m = most_way_m(cover, placed.cover[link], now);
  placed.way_m[link] += way_m < kFar_m ? way_m : kFar_m;
  placed.cover[link] = now;
  std::fill_n(placed.shown.begin() + cover.first_shape, cover.shape_count, char{0});
}

}  // namespace

void place(const RobotHand& hand, const Drive& drive, Placed& placed) noexcept {
  if (placed.drive == drive) return;
  placed.drive = drive;
  const bool covers = !placed.cover.empty();
  for (std::size_t l = 0; l < hand.links.size(); ++l) {
    const Link& link = hand.links[l];
    Eigen::Matrix3d turn = link.at.linear();
    Eigen::Vector3d at_m = link.at.translation();
    if (link.parent >= 0) {
      at_m = placed.at_m[link.parent] + placed.turn[link.parent] * at_m;
      turn = placed.turn[link.parent] * turn;
    }
    placed.at_m[l] = at_m;
    if (hand.joint_of_link[l] >= 0) {
      placed.axis[l] = turn * link.axis;
      const double angle = angle_of(hand.joints[hand.joint_of_link[l]], drive);
      turn = turn * Eigen::AngleAxisd(angle, link.axis).toRotationMatrix();
    }
    placed.turn[l] = turn;
    if (covers && hand.covers[l].count > 0) {
      move_cover(hand.covers[l], static_cast<int>(l), placed);
    }
  }
}

void add_slope(const RobotHand& hand, const Placed& placed, int link,
               const Eigen::Vector3d& point_m, const Eigen::Vector3d& direction,
               Drive& slope) noexcept {
  for (const Turn& turn : hand.turns[link]) {
    const Eigen::Vector3d moves = placed.axis[turn.link].cross(point_m - placed.at_m[turn.link]);
    slope[turn.driven] += turn.multiplier * direction.dot(moves);
  }
}

}  // namespace posed::robot
