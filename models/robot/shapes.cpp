#include "models/robot/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/hand/segments.hpp"

namespace posed::robot {
namespace {

constexpr int kMaxCapsulesABox = 4;
constexpr int kTries = 100;
constexpr double kMostly = 0.7;  // shapes that touch more often cannot be kept apart
constexpr double kOften = 0.1;   // capsules that touch so often may be too thick
constexpr int kLess = 4;         // hulls take over where they touch this many times less often
constexpr double kRounding_m = 1e-9;
constexpr double kLost_m = 1e3;    // also for what is no number: whatever was known is void
constexpr double kSlack_m = 6e-3;  // capsules this much beyond the nearest are kept
constexpr std::size_t kMaxHullPairs = 4096;  // half a second's work when a robot is loaded
constexpr double kOpen_m = 1e-3;  // shapes nearer than this at the start are made to touch
constexpr double kThin_m = 1e-3;  // a shape of a smaller radius has its corners rounded off

double per_length2(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const double length2 = (to_m - from_m).squaredNorm();
  return length2 > 1e-18 ? 1.0 / length2 : 0.0;
}

void add_capsule(RobotHand& hand, int link, const Eigen::Isometry3d& at,
                 const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) {
  hand.capsules.push_back({.link = link,
                           .shape = static_cast<int>(hand.balls.size()),
                           .from_m = at * from_m,
                           .to_m = at * to_m,
                           .radius_m = radius_m,
                           .per_m2 = per_length2(from_m, to_m)});
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

// The hull of a box, cylinder, capsule or sphere in its own frame.
Hull hull_of_solid(const Shape& shape) {
  constexpr int kRim = 16;
  Hull hull;
  const Eigen::Vector3d half = 0.5 * shape.size_m;
  if (shape.kind == Shape::Kind::kBox) {
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d side((k & 1) - 0.5, (k >> 1 & 1) - 0.5, (k >> 2) - 0.5);
      hull.corners.emplace_back(side.cwiseProduct(shape.size_m));
    }
  } else if (shape.kind == Shape::Kind::kCylinder) {
    for (int k = 0; k < kRim; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kRim;
      const double x = shape.size_m.x() * std::cos(angle), y = shape.size_m.x() * std::sin(angle);
      for (const double end : {half.y(), -half.y()}) hull.corners.emplace_back(x, y, end);
    }
    hull.radius_m = shape.size_m.x() * (1.0 - std::cos(std::numbers::pi / kRim));
  } else {
    hull.radius_m = shape.size_m.x();
    for (const double end : {half.y(), -half.y()}) hull.corners.emplace_back(0.0, 0.0, end);
  }
  return hull;
}

// The ball around the middle of the latest capsules.
Ball ball_of(const RobotHand& hand, int first) {
  Ball ball{.first = first, .count = static_cast<int>(hand.capsules.size()) - first};
  for (int c = first; c < first + ball.count; ++c) {
    ball.middle_m += 0.5 * (hand.capsules[c].from_m + hand.capsules[c].to_m) / ball.count;
  }
  for (int c = first; c < first + ball.count; ++c) {
    const Capsule& one = hand.capsules[c];
    const double far2 = std::max((one.from_m - ball.middle_m).squaredNorm(),
                                 (one.to_m - ball.middle_m).squaredNorm());
    ball.reach_m = std::max(ball.reach_m, std::sqrt(far2) + one.radius_m + kRounding_m);
  }
  return ball;
}

// The smallest capsule around those from `first` on that lies along an axis of the link's frame, as
// most boxes do.
Cover cover_of(const RobotHand& hand, int first) {
  Cover best{.first = first, .count = static_cast<int>(hand.capsules.size()) - first};
  const std::span<const Capsule> capsules(hand.capsules.data() + first,
                                          static_cast<std::size_t>(best.count));
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3 && best.count > 0; ++axis) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const Capsule& one : capsules) {
      const Eigen::Vector3d radius = Eigen::Vector3d::Constant(one.radius_m);
      low = low.cwiseMin(one.from_m.cwiseMin(one.to_m) - radius);
      high = high.cwiseMax(one.from_m.cwiseMax(one.to_m) + radius);
    }
    Eigen::Vector3d middle = 0.5 * (low + high);
    const auto across = [&](const Eigen::Vector3d& end) {
      Eigen::Vector3d off = end - middle;
      off[axis] = 0.0;
      return off.norm();
    };
    double radius_m = 0.0;
    for (const Capsule& one : capsules) {
      radius_m =
          std::max({radius_m, across(one.from_m) + one.radius_m, across(one.to_m) + one.radius_m});
    }
    double begin = 1e9, end = -1e9;
    for (const Capsule& one : capsules) {
      for (const Eigen::Vector3d& at : {one.from_m, one.to_m}) {
        const double inside = radius_m - one.radius_m;
        const double cap = std::sqrt(std::max(0.0, inside * inside - across(at) * across(at)));
        begin = std::min(begin, at[axis] + cap);
        end = std::max(end, at[axis] - cap);
      }
    }
    if (begin > end) begin = end = 0.5 * (begin + end);
    const double volume = radius_m * radius_m * (end - begin + 4.0 / 3.0 * radius_m);
    if (volume >= least) continue;
    least = volume;
    best.from_m = best.to_m = middle;
    best.from_m[axis] = begin;
    best.to_m[axis] = end;
    best.radius_m = radius_m + kRounding_m;
    best.per_m2 = per_length2(best.from_m, best.to_m);
  }
  return best;
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

// The capsules of a shape where they are now.
RT_SAFE void show(const RobotHand& hand, int shape, Placed& placed) noexcept {
  if (placed.shown[shape] != 0) return;
  placed.shown[shape] = 1;
  const Ball& ball = hand.balls[shape];
  const int link = hand.capsules[ball.first].link;
  const Eigen::Matrix3d turn = placed.turn[link];
  const Eigen::Vector3d at_m = placed.at_m[link];
  for (int c = ball.first; c < ball.first + ball.count; ++c) {
    placed.from_m[c] = at_m + turn * hand.capsules[c].from_m;
    placed.to_m[c] = at_m + turn * hand.capsules[c].to_m;
    placed.middle_m[c] = 0.5 * (placed.from_m[c] + placed.to_m[c]);
  }
}

RT_SAFE hand::Closest apart(const Placed& placed, int i, int j) noexcept {
  return hand::closest_points(placed.from_m[i], placed.to_m[i], placed.from_m[j], placed.to_m[j]);
}

RT_SAFE double away2(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                     const Eigen::Vector3d& to, double per_m2) noexcept {
  const Eigen::Vector3d along = to - from;
  const Eigen::Vector3d off = point - from;
  return (off - std::clamp(off.dot(along) * per_m2, 0.0, 1.0) * along).squaredNorm();
}

// Where the second link's cover is, as the first one sees it.
RT_SAFE CoverPose seen(const Placed& placed, int a, int b) noexcept {
  const Eigen::Matrix3d to_a = placed.turn[a].transpose();
  return {.turn = to_a * placed.turn[b],
          .from_m = to_a * (placed.cover[b].from_m - placed.at_m[a]),
          .to_m = to_a * (placed.cover[b].to_m - placed.at_m[a])};
}

RT_SAFE bool within(double distance2, double reach_m) noexcept {
  return reach_m > 0.0 && distance2 < reach_m * reach_m;
}

// Returns false only if two capsules are farther apart. Most are, and this is cheaper than their
// gap.
RT_SAFE bool may_be_within(const RobotHand& hand, const Placed& placed, int i, int j,
                           double within_m) noexcept {
  const Eigen::Vector3d& middle = placed.middle_m[i];
  const double reach_m = hand.reach_m[i] + hand.reach_m[j] + within_m;
  if (!within((middle - placed.middle_m[j]).squaredNorm(), reach_m)) return false;
  // Not the ball around i, but i itself: most of those that are left are too far from it.
  const double thin_m = hand.capsules[i].radius_m + hand.reach_m[j] + within_m;
  const double axis2 =
      away2(placed.middle_m[j], placed.from_m[i], placed.to_m[i], hand.capsules[i].per_m2);
  if (!within(axis2, thin_m)) return false;
  const double other2 = away2(middle, placed.from_m[j], placed.to_m[j], hand.capsules[j].per_m2);
  return within(other2, hand.capsules[j].radius_m + hand.reach_m[i] + within_m);
}

// The shapes of a link, and their capsules, that may be within `within_m` of another link's cover.
RT_SAFE std::span<const Placed::NearShape> near_shapes(const RobotHand& hand, Placed& placed,
                                                       int link, const CoverPose& at,
                                                       const Cover& cover,
                                                       double within_m) noexcept {
  std::size_t count = 0;
  int near = 0;
  const double cover_m = cover.radius_m + within_m;
  const Cover& own = hand.covers[link];
  for (int g = own.first_shape; g < own.first_shape + own.shape_count; ++g) {
    const Ball& ball = hand.balls[g];
    const Eigen::Vector3d middle_m = placed.at_m[link] + placed.turn[link] * ball.middle_m;
    const double off2 = away2(middle_m, at.from_m, at.to_m, cover.per_m2);
    if (!within(off2, ball.reach_m + cover_m)) continue;
    show(hand, g, placed);
    const int first = near;
    for (int j = ball.first; j < ball.first + ball.count; ++j) {
      const double away_m2 = away2(placed.middle_m[j], at.from_m, at.to_m, cover.per_m2);
      if (within(away_m2, hand.reach_m[j] + cover_m)) placed.near[near++] = j;
    }
    if (near == first) continue;
    placed.near_shapes[count++] = {
        .first = first, .count = near - first, .middle_m = middle_m, .reach_m = ball.reach_m};
  }
  return {placed.near_shapes.data(), count};
}

// Lists pairs of capsules of two links, nearest first: those with a gap of at most kSlack_m beyond
// both `near_m` and the least gap. Most capsules are too far from the other link's cover to be
// looked at.
RT_SAFE void find_close(const RobotHand& hand, Placed& placed, int a, int b, double near_m,
                        Placed::Close& close) noexcept {
  const Cover& all_a = hand.covers[a];
  const Cover& all_b = hand.covers[b];
  double within_m = near_m + kSlack_m;
  close.count = 0;
  const auto look = [&](int i, int j) {
    const double radii_m = hand.capsules[i].radius_m + hand.capsules[j].radius_m;
    const double distance2 = apart(placed, i, j).apart.squaredNorm();
    if (!within(distance2, radii_m + within_m)) return;
    const double found_m = std::sqrt(distance2) - radii_m;
    std::size_t at = close.count;
    if (at == close.two.size()) {
      within_m = std::min(within_m, close.two[--at].gap_m);
      if (found_m >= within_m) return;
    } else {
      ++close.count;
    }
    for (; at > 0 && close.two[at - 1].gap_m > found_m; --at) close.two[at] = close.two[at - 1];
    close.two[at] = {.gap_m = found_m, .a = i, .b = j};
    within_m = std::min(within_m, close.two[0].gap_m + kSlack_m);
  };
  const std::span<const Placed::NearShape> near =
      near_shapes(hand, placed, b, placed.cover[a], all_a, within_m);
  for (int g = all_a.first_shape; !near.empty() && g < all_a.first_shape + all_a.shape_count; ++g) {
    const Eigen::Vector3d middle_m = placed.at_m[a] + placed.turn[a] * hand.balls[g].middle_m;
    const double ball_m = hand.balls[g].reach_m + within_m;
    if (!within(away2(middle_m, placed.cover[b].from_m, placed.cover[b].to_m, all_b.per_m2),
                ball_m + all_b.radius_m)) {
      continue;
    }
    show(hand, g, placed);
    for (const Placed::NearShape& other : near) {
      if (!within((middle_m - other.middle_m).squaredNorm(), ball_m + other.reach_m)) continue;
      for (int i = hand.balls[g].first; i < hand.balls[g].first + hand.balls[g].count; ++i) {
        const double off2 =
            away2(other.middle_m, placed.from_m[i], placed.to_m[i], hand.capsules[i].per_m2);
        if (!within(off2, hand.capsules[i].radius_m + other.reach_m + within_m)) continue;
        for (int k = other.first; k < other.first + other.count; ++k) {
          const int j = placed.near[k];
          if (may_be_within(hand, placed, i, j, within_m)) look(i, j);
        }
      }
    }
  }
  close.others_m = within_m;
  close.seen = seen(placed, a, b);
}

// The least gap if it is below `near_m`, else what it is at least: `near_m` or more. All capsules
// are looked at only where links have gone so far that others may have become nearer than those
// that find_close() listed.
RT_SAFE Nearest nearest(const RobotHand& hand, Placed& placed, int a, int b,
                        double near_m) noexcept {
  Nearest best{.gap_m = near_m};
  if (hand.covers[a].count == 0 || hand.covers[b].count == 0) return best;
  Placed::Close& close = placed.close[static_cast<std::size_t>(a) * hand.links.size() + b];
  const auto look = [&](double way_m) {
    for (std::size_t k = 0; k < close.count; ++k) {
      const auto& [then_m, i, j] = close.two[k];
      if (then_m - way_m >= best.gap_m) return true;
      show(hand, hand.capsules[i].shape, placed);
      show(hand, hand.capsules[j].shape, placed);
      const auto closest = apart(placed, i, j);
      const double distance_m = closest.apart.norm();
      const double gap_m = distance_m - hand.capsules[i].radius_m - hand.capsules[j].radius_m;
      if (gap_m >= best.gap_m) continue;
      best.gap_m = gap_m;
      best.at_a = placed.from_m[i] + closest.s * (placed.to_m[i] - placed.from_m[i]);
      best.at_b = placed.from_m[j] + closest.t * (placed.to_m[j] - placed.from_m[j]);
      if (distance_m > 1e-9) best.apart = closest.apart / distance_m;
    }
    return close.others_m - way_m >= best.gap_m;
  };
  const double gone_m = most_way_m(hand.covers[b], close.seen, seen(placed, a, b)) + kRounding_m;
  if (look(gone_m)) {
    if (best.gap_m >= near_m) best.gap_m = std::max(near_m, close.least_m() - gone_m);
    return best;
  }
  find_close(hand, placed, a, b, best.gap_m, close);
  best.gap_m = near_m;
  look(0.0);
  if (best.gap_m >= near_m) best.gap_m = std::max(near_m, close.least_m());
  return best;
}

// The same by the hulls of a pair's shapes. Those that were nearest are looked at first: the nearer
// they are, the fewer others can be nearer.
RT_SAFE Nearest nearest_hulls(const RobotHand& hand, Placed& placed, std::size_t p,
                              double near_m) noexcept {
  const LinkPair& pair = hand.pairs[p];
  Placed::ByHulls& by = placed.by_hulls[p];
  const CoverPose now = seen(placed, pair.a, pair.b);
  const double way_m = most_way_m(hand.covers[pair.b], by.seen, now);
  by.way_m += way_m < kLost_m ? way_m : kLost_m;
  by.seen = now;
  Nearest best{.gap_m = near_m};
  const auto look = [&](int k) {
    Placed::Least& least = placed.hulls[k];
    if (least.gap_m - (by.way_m - least.way_m) > best.gap_m + kRounding_m) return;
    const auto [a, b] = hand.hull_pairs[k];
    const Nearest found = hull_gap({hand.hulls[a], placed.turn[pair.a], placed.at_m[pair.a]},
                                   {hand.hulls[b], placed.turn[pair.b], placed.at_m[pair.b]},
                                   placed.turn[pair.a] * placed.apart[k], best.gap_m);
    least = {.gap_m = found.gap_m, .way_m = by.way_m};
    placed.apart[k] = placed.turn[pair.a].transpose() * found.apart;
    if (found.gap_m >= best.gap_m) return;
    best = found;
    by.nearest = k - pair.first;
  };
  look(pair.first + by.nearest);
  for (int k = pair.first; k < pair.first + pair.count; ++k) {
    if (k != pair.first + by.nearest) look(k);
  }
  return best;
}

RT_SAFE void add_slopes(const RobotHand& hand, const Placed& placed, const Nearest& at,
                        Gap& gap) noexcept {
  gap.slope.setZero();
  add_slope(hand, placed, gap.a, at.at_a, at.apart, gap.slope);
  add_slope(hand, placed, gap.b, at.at_b, -at.apart, gap.slope);
}

RT_SAFE double cover_gap_m(const RobotHand& hand, const Placed& placed, int a, int b) noexcept {
  const auto closest = hand::closest_points(placed.cover[a].from_m, placed.cover[a].to_m,
                                            placed.cover[b].from_m, placed.cover[b].to_m);
  return closest.apart.norm() - hand.covers[a].radius_m - hand.covers[b].radius_m;
}

// Sets how far each turn can move the points of a link [m/rad]: their distance from its axis is at
// most the length of the chain between.
void add_swings(RobotHand& hand) {
  for (int l = 0; l < std::ssize(hand.links); ++l) {
    const Cover& cover = hand.covers[l];
    for (Turn& turn : hand.turns[l]) {
      double far_m = std::max(cover.from_m.norm(), cover.to_m.norm()) + cover.radius_m;
      for (int above = l; above != turn.link; above = hand.links[above].parent) {
        far_m += hand.links[above].at.translation().norm();
      }
      turn.swing_m = std::abs(turn.multiplier) * far_m;
    }
  }
}

// In how many of kTries poses two links touch; to touch in the start pose counts as always.
struct Touching {
  LinkPair pair;
  int capsules = 0, hulls = 0;
};

// Fills in the pairs of links that their capsules can keep apart; returns those whose capsules
// touch at the start or often.
std::vector<Touching> find_pairs(RobotHand& hand, Placed& placed) {
  std::vector<Touching> all;
  for (int a = 0; a < std::ssize(hand.links); ++a) {
    for (int b = a + 1; b < std::ssize(hand.links); ++b) {
      if (hand.covers[a].count == 0 || hand.covers[b].count == 0 || neighbours(hand, a, b))
        continue;
      if (hand.turns[a].empty() && hand.turns[b].empty()) continue;  // both stand
      all.push_back({.pair = {.a = a, .b = b}});
    }
  }
  for (int number = -1; number < kTries; ++number) {
    place(hand, number < 0 ? hand.start() : some_pose(hand, number), placed);
    for (Touching& one : all) {
      const auto [a, b] = std::pair(one.pair.a, one.pair.b);
      if (cover_gap_m(hand, placed, a, b) >= 0.0) continue;
      if (nearest(hand, placed, a, b, 0.0).gap_m >= 0.0) continue;
      one.capsules += number < 0 ? kTries : 1;
    }
  }
  for (const Touching& one : all) {
    if (one.capsules <= kMostly * kTries) hand.pairs.push_back(one.pair);
  }
  std::erase_if(all, [](const Touching& one) { return one.capsules <= kOften * kTries; });
  // First those that no capsules keep apart: there is room for kMaxHullPairs.
  std::ranges::stable_partition(
      all, [](const Touching& one) { return one.capsules > kMostly * kTries; });
  return all;
}

// Lists the hulls of such pairs, without those that touch at the start or mostly.
void find_hull_pairs(RobotHand& hand, Placed& placed, std::span<Touching> pairs) {
  struct Candidate {
    std::pair<int, int> two;
    std::size_t pair = 0;
    int touching = 0;
  };
  std::vector<Candidate> all;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const Cover& one = hand.covers[pairs[p].pair.a];
    const Cover& two = hand.covers[pairs[p].pair.b];
    const auto more = static_cast<std::size_t>(one.shape_count) * two.shape_count;
    if (all.size() + more > kMaxHullPairs) continue;
    for (int a = one.first_shape; a < one.first_shape + one.shape_count; ++a) {
      for (int b = two.first_shape; b < two.first_shape + two.shape_count; ++b) {
        all.push_back({.two = {a, b}, .pair = p});
      }
    }
  }
  for (int number = -1; number < kTries; ++number) {
    place(hand, number < 0 ? hand.start() : some_pose(hand, number), placed);
    std::vector<char> touch(pairs.size());
    for (Candidate& one : all) {
      if (one.touching > kMostly * kTries) continue;
      const int a = pairs[one.pair].pair.a, b = pairs[one.pair].pair.b;
      const double near_m = number < 0 ? kOpen_m : 0.0;
      const double gap_m = hull_gap({hand.hulls[one.two.first], placed.turn[a], placed.at_m[a]},
                                    {hand.hulls[one.two.second], placed.turn[b], placed.at_m[b]},
                                    Eigen::Vector3d::UnitX(), near_m)
                               .gap_m;
      if (gap_m >= near_m) continue;
      one.touching += number < 0 ? kTries : 1;
      touch[one.pair] = 1;
    }
    for (std::size_t p = 0; p < pairs.size(); ++p) pairs[p].hulls += touch[p];
  }
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    LinkPair& pair = pairs[p].pair;
    pair.first = static_cast<int>(hand.hull_pairs.size());
    for (const Candidate& one : all) {
      if (one.pair == p && one.touching <= kMostly * kTries) hand.hull_pairs.push_back(one.two);
    }
    pair.count = static_cast<int>(hand.hull_pairs.size()) - pair.first;
  }
}

// A hull may stick out of the capsules.
void widen_cover(RobotHand& hand, int link) {
  Cover& cover = hand.covers[link];
  for (int h = cover.first_shape; h < cover.first_shape + cover.shape_count; ++h) {
    for (const auto& corner : hand.hulls[h].corners) {
      const double off_m = std::sqrt(away2(corner, cover.from_m, cover.to_m, cover.per_m2));
      cover.radius_m = std::max(cover.radius_m, off_m + hand.hulls[h].radius_m);
    }
  }
}

}  // namespace

// A hull is tighter than the capsules of its shape, which stick out of it.
Hull hull_of_shape(const Shape& shape) {
  Hull hull = shape.hull.corners.empty() ? hull_of_solid(shape) : shape.hull;
  if (hull.radius_m < kThin_m) round_off(hull);
  for (auto& corner : hull.corners) corner = shape.at * corner;
  return hull;
}

void add_shapes(RobotHand& hand) {
  for (int l = 0; l < std::ssize(hand.links); ++l) {
    const int first = static_cast<int>(hand.capsules.size());
    for (const Shape& shape : hand.links[l].shapes) {
      const int begin = static_cast<int>(hand.capsules.size());
      add_shape(hand, l, shape);
      hand.balls.push_back(ball_of(hand, begin));
      hand.hulls.push_back(hull_of_shape(shape));
    }
    hand.covers.push_back(cover_of(hand, first));
    hand.covers[l].shape_count = static_cast<int>(hand.links[l].shapes.size());
    hand.covers[l].first_shape = static_cast<int>(hand.balls.size()) - hand.covers[l].shape_count;
  }
  Placed placed(hand);
  std::vector<Touching> touching = find_pairs(hand, placed);
  find_hull_pairs(hand, placed, touching);
  std::vector<char> by_hulls(hand.links.size());
  for (const auto& [pair, capsules, hulls] : touching) {
    const int all = hand.covers[pair.a].shape_count * hand.covers[pair.b].shape_count;
    const auto listed = std::ranges::find_if(
        hand.pairs, [&](const LinkPair& other) { return other.a == pair.a && other.b == pair.b; });
    if (listed == hand.pairs.end()) {
      if (pair.count < all) hand.left_out.emplace_back(pair.a, pair.b);
      if (pair.count == 0) continue;
      hand.pairs.push_back(pair);
    } else if (pair.count == all && kLess * hulls < capsules) {
      *listed = pair;
    } else {
      continue;
    }
    by_hulls[pair.a] = by_hulls[pair.b] = 1;
  }
  for (int l = 0; l < std::ssize(hand.links); ++l) {
    if (by_hulls[l] != 0) widen_cover(hand, l);
  }
  add_swings(hand);
}

std::span<const Gap> find_gaps(const RobotHand& hand, Placed& placed, const Near& near, bool slopes,
                               Gaps& gaps) noexcept {
  for (std::size_t l = 0; near.turn != nullptr && l < hand.links.size(); ++l) {
    placed.swing_m[l] = 0.0;
    for (const Turn& turn : hand.turns[l]) {
      placed.swing_m[l] += turn.swing_m * (*near.turn)[turn.driven];
    }
  }
  std::size_t count = 0, farthest = 0;  // farthest: of as many as there is room for
  for (std::size_t p = 0; p < hand.pairs.size(); ++p) {
    const int a = hand.pairs[p].a, b = hand.pairs[p].b;
    double near_m = count < gaps.size() ? near.most_m : gaps[farthest].gap_m;
    if (near.turn != nullptr) {
      near_m = std::min(near_m, near.least_m + placed.swing_m[a] + placed.swing_m[b]);
    }
    Placed::Least& least = placed.least[p];
    const double way_m = placed.way_m[a] + placed.way_m[b];
    if (least.gap_m - (way_m - least.way_m) > near_m + kRounding_m) continue;
    least = {.gap_m = cover_gap_m(hand, placed, a, b), .way_m = way_m};
    if (least.gap_m >= near_m) continue;
    const Nearest at = hand.pairs[p].count > 0 ? nearest_hulls(hand, placed, p, near_m)
                                               : nearest(hand, placed, a, b, near_m);
    least.gap_m = std::max(least.gap_m, at.gap_m);
    if (at.gap_m >= near_m) continue;
    const std::size_t into = count < gaps.size() ? count++ : farthest;
    gaps[into].a = a;
    gaps[into].b = b;
    gaps[into].gap_m = at.gap_m;
    if (slopes) add_slopes(hand, placed, at, gaps[into]);
    if (count < gaps.size()) continue;
    farthest =
        static_cast<std::size_t>(std::ranges::max_element(gaps, {}, &Gap::gap_m) - gaps.begin());
  }
  return {gaps.data(), count};
}

Gap gap_between(const RobotHand& hand, Placed& placed, int a, int b) noexcept {
  const Nearest at = nearest(hand, placed, a, b, std::numeric_limits<double>::infinity());
  Gap gap{.a = a, .b = b, .gap_m = at.gap_m};
  if (std::isfinite(at.gap_m)) add_slopes(hand, placed, at, gap);
  return gap;
}

Gap gap_of_tips(const RobotHand& hand, Placed& placed, const Finger& a, const Finger& b) noexcept {
  const auto shaped_end = [&](const Finger& finger) {
    int link = finger.tip;
    while (link != finger.last && hand.covers[link].count == 0) link = hand.links[link].parent;
    return link;
  };
  Gap gap = gap_between(hand, placed, shaped_end(a), shaped_end(b));
  if (std::isfinite(gap.gap_m)) return gap;
  Nearest at{.at_a = tip_of(a, placed), .at_b = tip_of(b, placed)};
  const double distance_m = (at.at_a - at.at_b).norm();
  if (distance_m > 1e-9) at.apart = (at.at_a - at.at_b) / distance_m;
  gap = {.a = a.tip, .b = b.tip, .gap_m = distance_m - a.tip_radius_m - b.tip_radius_m};
  add_slopes(hand, placed, at, gap);
  return gap;
}

}  // namespace posed::robot
