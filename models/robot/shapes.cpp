#include "models/robot/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/hand/segments.hpp"

namespace posed::robot {
namespace {

constexpr int kMaxCapsulesABox = 4;
constexpr int kTries = 100;
constexpr double kMostly = 0.7;

void add_capsule(RobotHand& hand, int link, const Eigen::Isometry3d& at,
                 const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) {
  hand.capsules.push_back(
      {.link = link, .from_m = at * from_m, .to_m = at * to_m, .radius_m = radius_m});
  hand.reach_m.push_back(0.5 * (to_m - from_m).norm() + radius_m);
}

// Capsules along the longest edge, side by side across the middle one. Each reaches its strip's
// corners: radius^2 = across^2 + (what the axis is shorter than the edge)^2.
void add_box(RobotHand& hand, int link, const Shape& shape) {
  std::array<int, 3> order{0, 1, 2};
  std::ranges::sort(order, [&](int a, int b) { return shape.size_m[a] > shape.size_m[b]; });
  const double long_m = 0.5 * shape.size_m[order[0]];
  const double middle_m = 0.5 * shape.size_m[order[1]];
  const double thin_m = std::max(0.5 * shape.size_m[order[2]], 1e-6);
  const int count =
      std::clamp(static_cast<int>(std::ceil(middle_m / thin_m - 1e-9)), 1, kMaxCapsulesABox);
  const double strip_m = middle_m / count;
  const double across_m = std::hypot(strip_m, thin_m);
  const double shorter_m = std::min(0.5 * across_m, long_m);
  const double radius_m = std::hypot(across_m, shorter_m);
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d aside = Eigen::Vector3d::Zero();
    aside[order[1]] = -middle_m + strip_m * (2 * i + 1);
    Eigen::Vector3d along = Eigen::Vector3d::Zero();
    along[order[0]] = long_m - shorter_m;
    add_capsule(hand, link, shape.at, aside - along, aside + along, radius_m);
  }
}

void add_shape(RobotHand& hand, int link, const Shape& shape) {
  const Eigen::Vector3d half(0.0, 0.0, 0.5 * shape.size_m.y());
  switch (shape.kind) {
    case Shape::Kind::kBox:
      return add_box(hand, link, shape);
    case Shape::Kind::kSphere:
      return add_capsule(hand, link, shape.at, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                         shape.size_m.x());
    case Shape::Kind::kCapsule:
      return add_capsule(hand, link, shape.at, -half, half, shape.size_m.x());
    case Shape::Kind::kCylinder: {
      const double shorter_m = std::min(0.5 * shape.size_m.x(), half.z());
      const Eigen::Vector3d end(0.0, 0.0, half.z() - shorter_m);
      return add_capsule(hand, link, shape.at, -end, end, std::hypot(shape.size_m.x(), shorter_m));
    }
  }
}

Ball ball_around(const RobotHand& hand, int first) {
  Ball ball{.first = first, .count = static_cast<int>(hand.capsules.size()) - first};
  if (ball.count == 0) return ball;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  for (int c = first; c < first + ball.count; ++c) {
    const Capsule& capsule = hand.capsules[c];
    low = low.cwiseMin(capsule.from_m).cwiseMin(capsule.to_m);
    high = high.cwiseMax(capsule.from_m).cwiseMax(capsule.to_m);
  }
  ball.middle_m = 0.5 * (low + high);
  for (int c = first; c < first + ball.count; ++c) {
    const Capsule& capsule = hand.capsules[c];
    ball.radius_m =
        std::max({ball.radius_m, (capsule.from_m - ball.middle_m).norm() + capsule.radius_m,
                  (capsule.to_m - ball.middle_m).norm() + capsule.radius_m});
  }
  return ball;
}

// The link whose joint turns a link: those that are fixed to each other are one body.
int body_of(const RobotHand& hand, int link) {
  while (link > 0 && !hand.links[link].turns) link = hand.links[link].parent;
  return link;
}

bool neighbours(const RobotHand& hand, int a, int b) {
  const int body_a = body_of(hand, a);
  const int body_b = body_of(hand, b);
  const auto above = [&](int body) {
    return body == 0 ? -1 : body_of(hand, hand.links[body].parent);
  };
  return body_a == body_b || above(body_a) == body_b || above(body_b) == body_a;
}

// A low-discrepancy point of the box of limits: the same on all machines.
Drive some_pose(const RobotHand& hand, int number) {
  Drive drive = Drive::Zero();
  for (int i = 0; i < hand.size(); ++i) {
    const double share = std::fmod(0.5 + (number + 1) * std::sqrt(2.0 + 3.0 * i), 1.0);
    drive[i] = hand.driven[i].low + share * (hand.driven[i].high - hand.driven[i].low);
  }
  return drive;
}

struct Nearest {
  double gap_m = 0.0;
  Eigen::Vector3d at_a = Eigen::Vector3d::Zero(), at_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d apart = Eigen::Vector3d::UnitX();  // from b to a
};

RT_SAFE Eigen::Vector3d world(const Placed& placed, int link, const Eigen::Vector3d& m) noexcept {
  return placed.at_m[link] + placed.turn[link] * m;
}

// The least gap below `near_m`; that itself where none is. The capsules that were nearest before
// are tried first: most others are then too far to be looked at.
RT_SAFE Nearest nearest(const RobotHand& hand, Placed& placed, int a, int b,
                        double near_m) noexcept {
  Nearest best{.gap_m = near_m};
  auto& before = placed.nearest[static_cast<std::size_t>(a) * hand.links.size() + b];
  const auto look = [&](int i, int j) {
    const Eigen::Vector3d& from = placed.from_m[i];
    const Eigen::Vector3d& begin = placed.from_m[j];
    const auto closest = hand::closest_points(from, placed.to_m[i], begin, placed.to_m[j]);
    const double distance_m = closest.apart.norm();
    const double gap_m = distance_m - hand.capsules[i].radius_m - hand.capsules[j].radius_m;
    if (gap_m >= best.gap_m) return;
    best.gap_m = gap_m;
    best.at_a = from + closest.s * (placed.to_m[i] - from);
    best.at_b = begin + closest.t * (placed.to_m[j] - begin);
    if (distance_m > 1e-9) best.apart = closest.apart / distance_m;
    before = {i, j};
  };
  const Ball& all_a = hand.balls[a];
  const Ball& all_b = hand.balls[b];
  if (all_a.count == 0 || all_b.count == 0) return best;
  const auto [first_i, first_j] = before;
  if (first_i >= 0) look(first_i, first_j);
  const Eigen::Vector3d middle_b = world(placed, b, all_b.middle_m);
  for (int i = all_a.first; i < all_a.first + all_a.count; ++i) {
    const Eigen::Vector3d middle = placed.middle_m[i];
    const Eigen::Vector3d half = placed.to_m[i] - middle;
    const double half_m2 = std::max(half.squaredNorm(), 1e-18);
    const double all_m = hand.reach_m[i] + all_b.radius_m + best.gap_m;
    if (all_m <= 0.0 || (middle - middle_b).squaredNorm() >= all_m * all_m) continue;
    for (int j = all_b.first; j < all_b.first + all_b.count; ++j) {
      const double reach_m = hand.reach_m[i] + hand.reach_m[j] + best.gap_m;
      if (reach_m <= 0.0 || (middle - placed.middle_m[j]).squaredNorm() >= reach_m * reach_m ||
          (i == first_i && j == first_j)) {
        continue;
      }
      // Not the ball around i, but i itself: most of those that are left are too far from it.
      const Eigen::Vector3d to_j = placed.middle_m[j] - middle;
      const double share = std::clamp(to_j.dot(half) / half_m2, -1.0, 1.0);
      const double thin_m = hand.capsules[i].radius_m + hand.reach_m[j] + best.gap_m;
      if (thin_m <= 0.0 || (to_j - share * half).squaredNorm() >= thin_m * thin_m) continue;
      look(i, j);
    }
  }
  return best;
}

RT_SAFE void add_slopes(const RobotHand& hand, const Placed& placed, const Nearest& at,
                        Gap& gap) noexcept {
  gap.slope.setZero();
  add_slope(hand, placed, gap.a, at.at_a, at.apart, gap.slope);
  add_slope(hand, placed, gap.b, at.at_b, -at.apart, gap.slope);
}

RT_SAFE bool may_be_near(const RobotHand& hand, const Placed& placed, int a, int b,
                         double near_m) noexcept {
  const Ball& one = hand.balls[a];
  const Ball& other = hand.balls[b];
  const double reach_m = one.radius_m + other.radius_m + near_m;
  return (world(placed, a, one.middle_m) - world(placed, b, other.middle_m)).squaredNorm() <
         reach_m * reach_m;
}

}  // namespace

void add_shapes(RobotHand& hand) {
  for (int l = 0; l < std::ssize(hand.links); ++l) {
    const int first = static_cast<int>(hand.capsules.size());
    for (const Shape& shape : hand.links[l].shapes) add_shape(hand, l, shape);
    hand.balls.push_back(ball_around(hand, first));
  }
  Placed placed(hand.links.size(), hand.capsules.size());
  std::vector<std::pair<int, int>> all;
  for (int a = 0; a < std::ssize(hand.links); ++a) {
    for (int b = a + 1; b < std::ssize(hand.links); ++b) {
      if (hand.balls[a].count == 0 || hand.balls[b].count == 0 || neighbours(hand, a, b)) continue;
      all.emplace_back(a, b);
    }
  }
  std::vector<int> touching(all.size());
  for (int number = -1; number < kTries; ++number) {
    place(hand, number < 0 ? hand.start() : some_pose(hand, number), placed);
    for (std::size_t p = 0; p < all.size(); ++p) {
      const auto [a, b] = all[p];
      if (!may_be_near(hand, placed, a, b, 0.0) || nearest(hand, placed, a, b, 0.0).gap_m >= 0.0)
        continue;
      touching[p] += number < 0 ? kTries : 1;
    }
  }
  for (std::size_t p = 0; p < all.size(); ++p) {
    const bool always = touching[p] > kMostly * kTries;
    (always ? hand.left_out : hand.pairs).push_back(all[p]);
  }
}

std::span<const Gap> find_gaps(const RobotHand& hand, Placed& placed, double near_m, bool slopes,
                               Gaps& gaps) noexcept {
  std::size_t count = 0;
  for (const auto& [a, b] : hand.pairs) {
    if (!may_be_near(hand, placed, a, b, near_m)) continue;
    const Nearest at = nearest(hand, placed, a, b, near_m);
    if (at.gap_m >= near_m) continue;
    std::size_t into = count;
    if (count == gaps.size()) {
      into =
          static_cast<std::size_t>(std::ranges::max_element(gaps, {}, &Gap::gap_m) - gaps.begin());
      if (gaps[into].gap_m <= at.gap_m) continue;
    } else {
      ++count;
    }
    gaps[into].a = a;
    gaps[into].b = b;
    gaps[into].gap_m = at.gap_m;
    if (slopes) add_slopes(hand, placed, at, gaps[into]);
  }
  return {gaps.data(), count};
}

Gap gap_between(const RobotHand& hand, Placed& placed, int a, int b) noexcept {
  const Nearest at = nearest(hand, placed, a, b, std::numeric_limits<double>::infinity());
  Gap gap{.a = a, .b = b, .gap_m = at.gap_m};
  if (std::isfinite(at.gap_m)) add_slopes(hand, placed, at, gap);
  return gap;
}

}  // namespace posed::robot
