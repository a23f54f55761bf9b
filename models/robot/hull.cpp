#include "models/robot/hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <set>
#include <utility>

#include <Eigen/LU>

namespace posed::robot {
namespace {

constexpr double kFine_m = 2e-4;   // what a hull may stick out to have fewer corners
constexpr double kRound_m = 7e-4;  // by which corners are rounded off
constexpr int kMaxSteps = 40;
constexpr std::size_t kMany = 10000;  // corners
constexpr double kExact = 1e-8;       // of the distance

// A corner of the set of all differences of the two hulls' points, from b's to a's.
struct Corner {
  Eigen::Vector3d a, b, apart;
};

// Up to four of them, and the point of their hull that is nearest to zero: each one's share in it.
struct Simplex {
  std::array<Corner, 4> corners;
  std::array<double, 4> share{};
  int count = 0;
};

// The shares of the nearest point to zero of what some of the corners span, into `share`. False: it
// lies outside of them.
template <int size>
RT_SAFE bool nearest_of(const Simplex& simplex, const std::array<int, 4>& of,
                        std::array<double, 4>& share) noexcept {
  const Eigen::Vector3d& first = simplex.corners[of[0]].apart;
  Eigen::Matrix<double, 3, size - 1> edges;
  for (int k = 1; k < size; ++k) edges.col(k - 1) = simplex.corners[of[k]].apart - first;
  const Eigen::Matrix<double, size - 1, size - 1> square = edges.transpose() * edges;
  const double volume2 = square.determinant();
  if (!(volume2 > 1e-12 * square.diagonal().prod())) return false;  // flat: fewer of them do
  const Eigen::Matrix<double, size - 1, 1> x =
      square.inverse() * (-(edges.transpose() * first)).eval();
  share.fill(0.0);
  share[of[0]] = 1.0 - x.sum();
  for (int k = 1; k < size; ++k) share[of[k]] = x[k - 1];
  return share[of[0]] >= 0.0 && x.minCoeff() >= 0.0;
}

RT_SAFE Eigen::Vector3d point_of(const Simplex& simplex,
                                 const std::array<double, 4>& share) noexcept {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int k = 0; k < simplex.count; ++k) point += share[k] * simplex.corners[k].apart;
  return point;
}

// Keeps only the corners that the nearest point to zero needs. All subsets with the latest corner
// are tried: there are at most 8, and no order of tests that rounding could mislead. The best of
// those without it is `before`, all corners but the latest by their shares.
RT_SAFE Eigen::Vector3d reduce(Simplex& simplex, const Eigen::Vector3d& before) noexcept {
  const unsigned latest = 1U << static_cast<unsigned>(simplex.count - 1);
  double least2 = std::numeric_limits<double>::infinity();
  std::array<double, 4> best{};
  if (simplex.count > 1) {
    least2 = before.squaredNorm();
    std::copy_n(simplex.share.begin(), simplex.count - 1, best.begin());
  }
  for (unsigned set = latest; set < 2 * latest; ++set) {
    std::array<int, 4> of{};
    int size = 0;
    for (int k = 0; k < simplex.count; ++k) {
      if ((set >> static_cast<unsigned>(k) & 1U) != 0) of[size++] = k;
    }
    std::array<double, 4> share{};
    share[of[0]] = 1.0;
    const bool inside = size == 1 || (size == 2 && nearest_of<2>(simplex, of, share)) ||
                        (size == 3 && nearest_of<3>(simplex, of, share)) ||
                        (size == 4 && nearest_of<4>(simplex, of, share));
    if (!inside) continue;
    const double found2 = point_of(simplex, share).squaredNorm();
    if (found2 >= least2) continue;
    least2 = found2;
    best = share;
  }
  int kept = 0;
  for (int k = 0; k < simplex.count; ++k) {
    if (best[k] <= 0.0) continue;
    simplex.corners[kept] = simplex.corners[k];
    simplex.share[kept++] = best[k];
  }
  simplex.count = kept;
  return point_of(simplex, simplex.share);
}

RT_SAFE const Eigen::Vector3d& farthest(const Hull& hull, const Eigen::Vector3d& along) noexcept {
  std::size_t best = 0;
  double most = hull.corners[0].dot(along);
  for (std::size_t k = 1; k < hull.corners.size(); ++k) {
    const double far = hull.corners[k].dot(along);
    if (far <= most) continue;
    most = far;
    best = k;
  }
  return hull.corners[best];
}

RT_SAFE Corner farthest(const PlacedHull& a, const PlacedHull& b,
                        const Eigen::Vector3d& along) noexcept {
  Corner corner;
  corner.a = a.at_m + a.turn * farthest(a.hull, a.turn.transpose() * along);
  corner.b = b.at_m + b.turn * farthest(b.hull, -(b.turn.transpose() * along));
  corner.apart = corner.a - corner.b;
  return corner;
}

}  // namespace

// Gilbert, Johnson and Keerthi: the nearest point to zero of the differences' hull, by the corner
// that is farthest towards zero from the nearest point so far. How far that one lies along it is
// the least that the hulls can be apart.
Nearest hull_gap(const PlacedHull& a, const PlacedHull& b, const Eigen::Vector3d& guess,
                 double near_m) noexcept {
  const double radii_m = a.hull.radius_m + b.hull.radius_m;
  Simplex simplex;
  Eigen::Vector3d nearest = guess;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Corner next = farthest(a, b, -nearest);
    const double distance = nearest.norm();
    const double along = nearest.dot(next.apart);
    if (along > distance * std::max(near_m + radii_m, 0.0)) {
      return {.gap_m = along / distance - radii_m, .apart = nearest / distance};
    }
    const bool known =
        std::any_of(simplex.corners.begin(), simplex.corners.begin() + simplex.count,
                    [&](const Corner& corner) { return corner.apart == next.apart; });
    if (simplex.count > 0 && (known || distance * distance - along <= kExact * distance * distance))
      break;
    simplex.corners[simplex.count++] = next;
    nearest = reduce(simplex, nearest);
    if (simplex.count == 4 || nearest.squaredNorm() < 1e-18) break;  // zero is inside
  }
  const double distance_m = nearest.norm();
  Nearest found{.gap_m = distance_m - radii_m};
  for (int k = 0; k < simplex.count; ++k) {
    found.at_a += simplex.share[k] * simplex.corners[k].a;
    found.at_b += simplex.share[k] * simplex.corners[k].b;
  }
  if (distance_m > 1e-9) {
    found.apart = nearest / distance_m;
  } else if (guess.squaredNorm() > 0.0) {
    found.apart = guess.normalized();  // overlapping so deep, they have no direction of their own
  }
  return found;
}

namespace {

// How far a corner is from the hull of a hull's corners.
double outside_m(const Eigen::Vector3d& corner, const Hull& hull) {
  const Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  const Hull one{.corners = {corner}};
  return hull_gap({one, turn, at_m}, {hull, turn, at_m}, Eigen::Vector3d::UnitX(),
                  std::numeric_limits<double>::infinity())
             .gap_m +
         hull.radius_m;
}

// Those that are farthest in some of all directions, which a Fibonacci sphere spreads.
std::vector<Eigen::Vector3d> outermost(std::span<const Eigen::Vector3d> corners) {
  constexpr int kDirections = 500;
  std::set<std::size_t> all;
  for (int k = 0; k < kDirections; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / kDirections;
    const double across = std::sqrt(1.0 - z * z);
    const double angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const Eigen::Vector3d along(across * std::cos(angle), across * std::sin(angle), z);
    std::size_t best = 0;
    double most = corners[0].dot(along);
    for (std::size_t c = 1; c < corners.size(); ++c) {
      const double far = corners[c].dot(along);
      if (far <= most) continue;
      most = far;
      best = c;
    }
    all.insert(best);
  }
  std::vector<Eigen::Vector3d> outer;
  outer.reserve(all.size());
  for (const std::size_t c : all) outer.push_back(corners[c]);
  return outer;
}

// The corner that is farthest from the hull of those before joins them. What is known of the others
// is an upper bound: a hull that grows comes nearer.
Hull hull_of_few(std::span<const Eigen::Vector3d> corners) {
  Hull hull{.corners = {corners[0]}};
  std::priority_queue<std::pair<double, std::size_t>> farthest_first;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    farthest_first.emplace(std::numeric_limits<double>::infinity(), k);
  }
  while (!farthest_first.empty()) {
    const std::size_t k = farthest_first.top().second;
    farthest_first.pop();
    const double away_m = outside_m(corners[k], hull);
    if (!farthest_first.empty() && away_m < farthest_first.top().first) {
      farthest_first.emplace(away_m, k);
      continue;
    }
    if (away_m < kFine_m || hull.corners.size() == kMaxHullCorners) {
      hull.radius_m = away_m;
      break;
    }
    hull.corners.push_back(corners[k]);
  }
  return hull;
}

}  // namespace

// Of many corners each is looked at once a direction, and once more for the radius.
Hull hull_of(std::span<const Eigen::Vector3d> corners) {
  if (corners.size() <= kMany) return hull_of_few(corners);
  Hull hull = hull_of_few(outermost(corners));
  for (const auto& corner : corners) {
    hull.radius_m = std::max(hull.radius_m, outside_m(corner, hull));
  }
  return hull;
}

void round_off(Hull& hull) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& corner : hull.corners) middle += corner;
  middle /= static_cast<double>(hull.corners.size());
  for (auto& corner : hull.corners) {
    const double far_m = (middle - corner).norm();
    if (far_m > 0.0) corner += std::min(kRound_m / far_m, 0.5) * (middle - corner);
  }
  if (hull.corners.size() > 1) hull.radius_m += kRound_m;
}

}  // namespace posed::robot
