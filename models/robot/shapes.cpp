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
constexpr double kRounding_m = 1e-9;
constexpr double kSlack_m = 6e-3;  // of what is remembered as close

double per_length2(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const double length2 = (to_m - from_m).squaredNorm();
  return length2 > 1e-18 ? 1.0 / length2 : 0.0;
}

void add_capsule(RobotHand& hand, int link, const Eigen::Isometry3d& at,
                 const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) {
  hand.capsules.push_back({.link = link,
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

// The smallest of those along the axes of the link's frame, in which most boxes lie.
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

struct Nearest {
  double gap_m = 0.0;
  Eigen::Vector3d at_a = Eigen::Vector3d::Zero(), at_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d apart = Eigen::Vector3d::UnitX();  // from b to a
};

// The capsules of a link where they are now.
RT_SAFE void show(const RobotHand& hand, int link, Placed& placed) noexcept {
  if (placed.shown[link] != 0) return;
  placed.shown[link] = 1;
  const Cover& cover = hand.covers[link];
  const Eigen::Matrix3d turn = placed.turn[link];
  const Eigen::Vector3d at_m = placed.at_m[link];
  for (int c = cover.first; c < cover.first + cover.count; ++c) {
    placed.from_m[c] = at_m + turn * hand.capsules[c].from_m;
    placed.to_m[c] = at_m + turn * hand.capsules[c].to_m;
    placed.middle_m[c] = 0.5 * (placed.from_m[c] + placed.to_m[c]);
  }
}

RT_SAFE hand::Closest apart(const Placed& placed, int i, int j) noexcept {
  return hand::closest_points(placed.from_m[i], placed.to_m[i], placed.from_m[j], placed.to_m[j]);
}

RT_SAFE double gap_m(const RobotHand& hand, const Placed& placed, int i, int j) noexcept {
  return apart(placed, i, j).apart.norm() - hand.capsules[i].radius_m - hand.capsules[j].radius_m;
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

// Lists the capsules of two links that are nearer than both `near_m` and the nearest ones, and
// kSlack_m. Most capsules are too far from the other link's cover to be looked at.
RT_SAFE void find_close(const RobotHand& hand, const Placed& placed, int a, int b, double near_m,
                        std::span<int> near_b, Placed::Close& close) noexcept {
  const Cover& all_a = hand.covers[a];
  const Cover& all_b = hand.covers[b];
  double within_m = near_m + kSlack_m;
  close.count = 0;
  const auto look = [&](int i, int j) {
    const double found_m = gap_m(hand, placed, i, j);
    if (found_m >= within_m) return;
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
  int near = 0;
  for (int j = all_b.first; j < all_b.first + all_b.count; ++j) {
    const double off2 =
        away2(placed.middle_m[j], placed.cover[a].from_m, placed.cover[a].to_m, all_a.per_m2);
    if (within(off2, hand.reach_m[j] + all_a.radius_m + within_m)) near_b[near++] = j;
  }
  for (int i = all_a.first; near > 0 && i < all_a.first + all_a.count; ++i) {
    const Eigen::Vector3d& middle = placed.middle_m[i];
    const double all_m = hand.reach_m[i] + all_b.radius_m + within_m;
    const double off2 = away2(middle, placed.cover[b].from_m, placed.cover[b].to_m, all_b.per_m2);
    if (!within(off2, all_m)) continue;
    for (int k = 0; k < near; ++k) {
      const int j = near_b[k];
      const double reach_m = hand.reach_m[i] + hand.reach_m[j] + within_m;
      if (!within((middle - placed.middle_m[j]).squaredNorm(), reach_m)) continue;
      // Not the ball around i, but i itself: most of those that are left are too far from it.
      const double thin_m = hand.capsules[i].radius_m + hand.reach_m[j] + within_m;
      const double axis2 =
          away2(placed.middle_m[j], placed.from_m[i], placed.to_m[i], hand.capsules[i].per_m2);
      if (!within(axis2, thin_m)) continue;
      const double other2 =
          away2(middle, placed.from_m[j], placed.to_m[j], hand.capsules[j].per_m2);
      if (within(other2, hand.capsules[j].radius_m + hand.reach_m[i] + within_m)) look(i, j);
    }
  }
  close.others_m = within_m;
  close.seen = seen(placed, a, b);
}

// The least gap below `near_m`; that itself where none is. All capsules are looked at only where
// links have gone so far that others may have become nearer than those that were.
RT_SAFE Nearest nearest(const RobotHand& hand, Placed& placed, int a, int b,
                        double near_m) noexcept {
  Nearest best{.gap_m = near_m};
  if (hand.covers[a].count == 0 || hand.covers[b].count == 0) return best;
  show(hand, a, placed);
  show(hand, b, placed);
  Placed::Close& close = placed.close[static_cast<std::size_t>(a) * hand.links.size() + b];
  const auto look = [&](double way_m) {
    for (std::size_t k = 0; k < close.count; ++k) {
      const auto& [then_m, i, j] = close.two[k];
      if (then_m - way_m >= best.gap_m) return true;
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
  if (look(gone_m)) return best;
  double least_m = near_m;
  if (close.count > 0) {
    least_m = std::min(least_m, gap_m(hand, placed, close.two[0].a, close.two[0].b));
  }
  find_close(hand, placed, a, b, least_m, placed.near, close);
  best.gap_m = near_m;
  look(0.0);
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

// How far from an axis the points of a link can get: along the chain between them.
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

}  // namespace

void add_shapes(RobotHand& hand) {
  for (int l = 0; l < std::ssize(hand.links); ++l) {
    const int first = static_cast<int>(hand.capsules.size());
    for (const Shape& shape : hand.links[l].shapes) add_shape(hand, l, shape);
    hand.covers.push_back(cover_of(hand, first));
  }
  Placed placed(hand);
  std::vector<std::pair<int, int>> all;
  for (int a = 0; a < std::ssize(hand.links); ++a) {
    for (int b = a + 1; b < std::ssize(hand.links); ++b) {
      if (hand.covers[a].count == 0 || hand.covers[b].count == 0 || neighbours(hand, a, b))
        continue;
      all.emplace_back(a, b);
    }
  }
  std::vector<int> touching(all.size());
  for (int number = -1; number < kTries; ++number) {
    place(hand, number < 0 ? hand.start() : some_pose(hand, number), placed);
    for (std::size_t p = 0; p < all.size(); ++p) {
      const auto [a, b] = all[p];
      if (cover_gap_m(hand, placed, a, b) >= 0.0) continue;
      if (nearest(hand, placed, a, b, 0.0).gap_m >= 0.0) continue;
      touching[p] += number < 0 ? kTries : 1;
    }
  }
  for (std::size_t p = 0; p < all.size(); ++p) {
    const bool always = touching[p] > kMostly * kTries;
    (always ? hand.left_out : hand.pairs).push_back(all[p]);
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
  std::size_t count = 0;
  for (std::size_t p = 0; p < hand.pairs.size(); ++p) {
    const auto [a, b] = hand.pairs[p];
    double near_m = near.most_m;
    if (near.turn != nullptr) {
      near_m = std::min(near_m, near.least_m + placed.swing_m[a] + placed.swing_m[b]);
    }
    Placed::Least& least = placed.least[p];
    const double way_m = placed.way_m[a] + placed.way_m[b];
    if (least.gap_m - (way_m - least.way_m) > near_m + kRounding_m) continue;
    least = {.gap_m = cover_gap_m(hand, placed, a, b), .way_m = way_m};
    if (least.gap_m >= near_m) continue;
    const Nearest at = nearest(hand, placed, a, b, near_m);
    least.gap_m = std::max(least.gap_m, at.gap_m);
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
