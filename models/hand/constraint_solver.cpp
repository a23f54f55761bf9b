#include "models/hand/constraint_solver.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numbers>

#include "models/hand/contacts.hpp"
#include "models/hand/projection.hpp"

namespace posed::hand {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kNear_m = 3e-3;            // pairs this near take part in the projection
constexpr double kFar_m = 10e-3;            // gaps above need not be known
constexpr double kHinge_rad = 4 * kDegree;  // a limit is felt this much before it is reached
constexpr double kDone_rad = 1e-6;
constexpr int kMaxRounds = 10;
constexpr int kHalvings = 20;
constexpr double kLeastWeight = 1e-9;  // variances, of the largest one

// `over` is how far an angle lies inside its limit, less than kHinge_rad: bent smoothly onto zero.
// A quadratic in place of algorithms.md's softplus, so that angles well inside stay as they are.
double hinged(double over) noexcept {
  if (over <= -kHinge_rad) return 0.0;
  return (over + kHinge_rad) * (over + kHinge_rad) / (4 * kHinge_rad);
}

double within(double q, double low, double high, bool soft) noexcept {
  if (!soft || high - low < 2 * kHinge_rad) return std::clamp(q, low, high);
  if (q - low < kHinge_rad) return low + hinged(q - low);
  if (high - q < kHinge_rad) return high - hinged(high - q);
  return q;
}

// The same angles with straight fingers that lie side by side: they cannot cross, however far each
// of them closes.
HandAngles parallel(const HandAngles& angles) noexcept {
  HandAngles out = angles;
  for (int c = kFingerChannels; c < kHandChannels; ++c) {
    if (c % 3 != 0) out[c] = 0.0;
  }
  return out;
}

HandAngles between(const HandAngles& from, const HandAngles& to, double share) noexcept {
  HandAngles out;
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = from[c] + share * (to[c] - from[c]);
  return out;
}

}  // namespace

struct ConstraintSolver::State {
  HandGeometry geometry;
  ConstraintOptions options;
  Forces forces;
  std::bitset<kBonePairs> touching;
  HandPose pose;
  Gaps gaps_m{};
  std::array<Row, kMaxRows> rows{};

  double gap_of(const HandAngles& angles) noexcept {
    place(geometry, angles, pose);
    find_gaps(geometry, pose, kFar_m, gaps_m);
    return smallest(gaps_m);
  }

  // The constraints of the pairs that are near, linearised at `at`; the nearest where there is no
  // room for all.
  std::span<const Row> near_rows(const HandAngles& at) noexcept {
    std::array<std::uint8_t, kBonePairs> order{};
    std::size_t count = 0;
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      if (gaps_m[p] < kNear_m) order[count++] = static_cast<std::uint8_t>(p);
    }
    if (count > kMaxRows) {
      std::nth_element(order.begin(), order.begin() + kMaxRows, order.begin() + count,
                       [this](auto a, auto b) { return gaps_m[a] < gaps_m[b]; });
      count = kMaxRows;
      std::sort(order.begin(), order.begin() + kMaxRows);
    }
    for (std::size_t r = 0; r < count; ++r) {
      const int p = order[r];
      Row& row = rows[r];
      row = {.pair = p,
             .finger_a = kPairs[p].a / kFingerJoints,
             .finger_b = kPairs[p].b / kFingerJoints,
             .slope = slope_of(pose, kPairs[p]),
             .least = options.margin_m - gaps_m[p]};
      for (int c = 0; c < kFingerChannels; ++c) {
        row.least += row.slope.a[c] * at[kFingerChannels * row.finger_a + c] +
                     row.slope.b[c] * at[kFingerChannels * row.finger_b + c];
      }
    }
    return {rows.data(), count};
  }

  // Sequential QP from `target`. The gap after the last round.
  double separate(const HandAngles& target, const HandAngles& variance, HandAngles& angles,
                  ConstraintReport& report) noexcept {
    const Box box{geometry.low_rad, geometry.high_rad};
    double gap_m = gap_of(angles);
    if (gap_m >= options.margin_m) {
      forces = {};
      return gap_m;
    }
    for (report.rounds = 0; report.rounds < kMaxRounds;) {
      ++report.rounds;
      const HandAngles next =
          project(target, variance, near_rows(angles), options.limits ? &box : nullptr, forces);
      double step_rad = 0.0;
      for (std::size_t c = 0; c < next.size(); ++c) {
        step_rad = std::max(step_rad, std::abs(next[c] - angles[c]));
      }
      angles = next;
      gap_m = gap_of(angles);
      if (step_rad < kDone_rad || !std::isfinite(step_rad)) break;
    }
    return gap_m;
  }

  // The first pose on the way to `safe` that has a gap; the way's end where none is found earlier.
  double retreat(const HandAngles& safe, HandAngles& angles) noexcept {
    const HandAngles from = angles;
    double gap_m = gap_of(safe);
    angles = safe;
    if (gap_m < 0.0) return gap_m;
    double bad = 0.0;
    double good = 1.0;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (bad + good);
      const HandAngles there = between(from, safe, middle);
      const double there_m = gap_of(there);
      if (there_m < 0.0) {
        bad = middle;
      } else {
        good = middle;
        gap_m = there_m;
        angles = there;
      }
    }
    return gap_m;
  }

  int count_touching() noexcept {
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      touching[p] = forces.contact[p] > 0.0 || (touching[p] && gaps_m[p] < options.leave_m);
    }
    return static_cast<int>(touching.count());
  }
};

ConstraintSolver::ConstraintSolver(const HandShape& shape, const ConstraintOptions& options)
    : ConstraintSolver(hand_geometry(shape), options) {}
ConstraintSolver::ConstraintSolver(const HandGeometry& geometry, const ConstraintOptions& options)
    : state_(std::make_unique<State>()) {
  state_->geometry = geometry;
  state_->options = options;
}
ConstraintSolver::~ConstraintSolver() = default;
ConstraintSolver::ConstraintSolver(ConstraintSolver&&) noexcept = default;
ConstraintSolver& ConstraintSolver::operator=(ConstraintSolver&&) noexcept = default;

ConstraintReport ConstraintSolver::step(HandAngles& angles, const HandAngles& variance) noexcept {
  State& state = *state_;
  ConstraintReport report;
  if (!std::ranges::all_of(angles, [](double q) { return std::isfinite(q); })) {
    report.left_alone = true;
    return report;
  }
  const HandAngles given = angles;
  HandAngles weight;
  for (std::size_t c = 0; c < weight.size(); ++c) {
    const bool usable = std::isfinite(variance[c]) && variance[c] > 0.0;
    weight[c] = usable ? variance[c] : kDegree * kDegree;
  }
  const double most = *std::ranges::max_element(weight);
  for (double& w : weight) w = std::max(w / most, kLeastWeight);
  const HandGeometry& geometry = state.geometry;
  if (state.options.limits) {
    for (std::size_t c = 0; c < angles.size(); ++c) {
      angles[c] =
          within(angles[c], geometry.low_rad[c], geometry.high_rad[c], state.options.soft_limits);
    }
  }
  if (state.options.collisions) {
    const HandAngles target = angles;
    report.min_gap_m = state.separate(target, weight, angles, report);
    const bool is_apart = report.min_gap_m >= 0.0;  // false for NaN too
    if (!is_apart) {
      if (!std::isfinite(report.min_gap_m)) angles = target;
      report.min_gap_m = state.retreat(parallel(angles), angles);
      if (report.min_gap_m < 0.0) report.min_gap_m = state.retreat({}, angles);
      state.forces = {};
      report.retreated = true;
    }
    report.touching = state.count_touching();
  } else {
    report.min_gap_m = state.gap_of(angles);
  }
  for (std::size_t c = 0; c < angles.size(); ++c) {
    report.changed_rad = std::max(report.changed_rad, std::abs(angles[c] - given[c]));
  }
  return report;
}

void ConstraintSolver::reset() noexcept {
  state_->forces = {};
  state_->touching.reset();
}

double min_gap_m(const HandGeometry& geometry, const HandAngles& angles) noexcept {
  HandPose pose;
  Gaps gaps_m;
  place(geometry, angles, pose);
  find_gaps(geometry, pose, kFar_m, gaps_m);
  return smallest(gaps_m);
}

}  // namespace posed::hand
