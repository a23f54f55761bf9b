#include "models/hand/constraint_solver.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>

#include "models/hand/contacts.hpp"
#include "models/hand/geometry.hpp"
#include "models/hand/projection.hpp"
#include "proto/frame/degree.hpp"

namespace posed::hand {
namespace {

constexpr double kFar_m = 10e-3;  // gaps above this are not computed

constexpr double kNear_m = 3e-3;            // pairs nearer than this take part in the projection
constexpr double kHinge_rad = 4 * kDegree;  // bending starts this far inside a limit
constexpr double kDone_rad = 3e-5;
constexpr double kSame_rad = 0.01;     // two poses on their way to the same result
constexpr double kMaxStep_rad = 0.35;  // largest step of one linearisation
constexpr double kDeep_m = 2e-3;
constexpr double kSliver_m = 1e-5;  // a gap that stays positive after rounding to a Frame's floats
constexpr double kLoyalty = 0.7;  // another side must cost less than this share of the present one
constexpr int kMaxRounds = 16;
constexpr int kHalvings = 10;
constexpr int kStartHalvings = 4;    // a start need not be exact
constexpr double kMinWeight = 1e-9;  // smallest weight, relative to the largest one

// `over` is the distance of an angle inside its limit, less than kHinge_rad; it is bent smoothly
// onto zero. A quadratic is used instead of a softplus, so that angles well inside do not change
// (models/hand/README.md, "Limits bent softly").
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

// The same angles with spread and twist of the four fingers at zero, so that they are side by side:
// they cannot cross, however far each of them closes.
HandAngles parallel(const HandAngles& angles) noexcept {
  HandAngles out = angles;
  for (int c = kFingerChannels; c < kHandChannels; ++c) {
    if (c % 3 != 0) out[c] = 0.0;
  }
  return out;
}

double largest_difference(const HandAngles& a, const HandAngles& b) noexcept {
  double largest = 0.0;
  for (std::size_t c = 0; c < a.size(); ++c) {
    const double difference = std::abs(a[c] - b[c]);
    if (!(difference <= largest)) largest = difference;  // keeps a NaN
  }
  return largest;
}

HandAngles difference(const HandAngles& a, const HandAngles& b) noexcept {
  HandAngles out;
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = a[c] - b[c];
  return out;
}

// By how much to extend the step from `at` to `next`, at least 1: steps that shrink by the same
// factor f in the same direction sum up to 1 / (1 - f) times the latest one (Aitken). `last` is the
// step before; zero: unknown.
double extension(const HandAngles& at, const HandAngles& next, const HandAngles& last) noexcept {
  double along = 0.0, before = 0.0, now = 0.0;
  for (std::size_t c = 0; c < at.size(); ++c) {
    const double step = next[c] - at[c];
    along += step * last[c];
    before += last[c] * last[c];
    now += step * step;
  }
  const bool same_direction = along > 0.0 && along * along > 0.8 * before * now;
  const double factor = same_direction ? along / before : 0.0;
  return factor < 0.95 ? 1.0 / (1.0 - factor) : 1.0;
}

HandAngles clamped(const HandAngles& angles, const Box& box) noexcept {
  HandAngles out;
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c] = std::clamp(angles[c], box.low_rad[c], box.high_rad[c]);
  }
  return out;
}

HandAngles between(const HandAngles& from, const HandAngles& to, double share) noexcept {
  HandAngles out;
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = from[c] + share * (to[c] - from[c]);
  return out;
}

}  // namespace

// PlacedHand: a hand in its latest pose, and the gaps between its bones there. A solver moves some
// fingers a little and looks again, so fingers whose angles are the same as in the pose before, to
// the bit, keep their places, and pairs of two such fingers their gaps. One stream, one thread.
class PlacedHand {
 public:
  explicit PlacedHand(const HandGeometry& geometry) : geometry_(geometry) {}

  // Puts the hand into a pose; returns its smallest gap [m], at most 10 mm.
  RT_SAFE double move_to(const HandAngles& angles) noexcept;

  [[nodiscard]] const HandGeometry& geometry() const noexcept { return geometry_; }
  [[nodiscard]] const HandPose& pose() const noexcept { return pose_; }
  // Exact below 10 mm.
  [[nodiscard]] const Gaps& gaps_m() const noexcept { return gaps_m_; }

 private:
  HandGeometry geometry_;
  HandAngles angles_{};
  HandPose pose_;
  Gaps gaps_m_{};
  double smallest_m_ = 0.0;
  bool is_placed_ = false;
};

double PlacedHand::move_to(const HandAngles& angles) noexcept {
  Fingers moved = kAllFingers;
  for (int f = 0; is_placed_ && f < kFingers; ++f) {
    const auto first = angles.begin() + kFingerChannels * f;
    moved[f] = !std::equal(first, first + kFingerChannels, angles_.begin() + kFingerChannels * f);
  }
  if (moved.none()) return smallest_m_;
  for (int f = 0; f < kFingers; ++f) {
    if (moved[f]) place_finger(geometry_, f, angles, pose_);
  }
  find_gaps(geometry_, pose_, kFar_m, gaps_m_, moved);
  angles_ = angles;
  is_placed_ = true;
  smallest_m_ = smallest(gaps_m_);
  return smallest_m_;
}

struct ConstraintSolver::State {
  State(const HandGeometry& geometry, const ConstraintOptions& wanted)
      : hand(geometry), options(wanted) {
    options.margin_m = std::max(options.margin_m, kSliver_m);
  }

  PlacedHand hand;
  ConstraintOptions options;
  Forces forces{};
  std::bitset<kBonePairs> touching;
  std::array<Row, kMaxRows> rows{};
  HandAngles before{};   // the result of the previous frame
  bool follows = false;  // the previous frame was held apart

  // The constraints of the pairs that are near, linearised at `at`; only the nearest ones where
  // there are too many.
  std::span<const Row> near_rows(const HandAngles& at) noexcept {
    const Gaps& gaps_m = hand.gaps_m();
    std::array<std::uint8_t, kBonePairs> order{};
    std::size_t count = 0;
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      if (gaps_m[p] < kNear_m) order[count++] = static_cast<std::uint8_t>(p);
    }
    if (count > kMaxRows) {
      std::nth_element(order.begin(), order.begin() + kMaxRows, order.begin() + count,
                       [&gaps_m](auto a, auto b) { return gaps_m[a] < gaps_m[b]; });
      count = kMaxRows;
      std::sort(order.begin(), order.begin() + kMaxRows);
    }
    for (std::size_t r = 0; r < count; ++r) {
      const int p = order[r];
      Row& row = rows[r];
      row = {.pair = p,
             .finger_a = kPairs[p].a / kFingerJoints,
             .finger_b = kPairs[p].b / kFingerJoints,
             .slope = slope_of(hand.pose(), kPairs[p]),
             .least = options.margin_m - gaps_m[p]};
      for (int c = 0; c < kFingerChannels; ++c) {
        row.least += row.slope.a[c] * at[kFingerChannels * row.finger_a + c] +
                     row.slope.b[c] * at[kFingerChannels * row.finger_b + c];
      }
    }
    return {rows.data(), count};
  }

  // One descent to the nearest pose: its start and its result.
  struct Path {
    HandAngles angles;
    Forces forces;
    double gap_m = 0.0;
    double cost = std::numeric_limits<double>::infinity();  // infinite: fingers still overlap
    int rounds = 0;
  };

  // Sequential QP towards `target`. Ends early where it comes near the result of `known`: then it
  // would become that one. Null: none is known.
  void descend(const HandAngles& target, const HandAngles& variance, Path& path,
               const Path* known = nullptr) noexcept {
    const Box box{hand.geometry().low_rad, hand.geometry().high_rad};
    HandAngles last{};  // the step before; zero: none, or an extended one
    path.gap_m = hand.move_to(path.angles);
    for (path.rounds = 0; path.rounds < kMaxRounds;) {
      ++path.rounds;
      const HandAngles next = project(target, variance, near_rows(path.angles),
                                      options.limits ? &box : nullptr, path.forces);
      const double step_rad = largest_difference(next, path.angles);
      if (!std::isfinite(step_rad)) return;
      const bool may_extend = path.rounds < kMaxRounds;
      const double share = may_extend ? extension(path.angles, next, last) : 1.0;
      last = share > 1.0 ? HandAngles{} : difference(next, path.angles);
      // A linearisation is not valid far from where it was made.
      path.angles = between(path.angles, next, std::min(share, kMaxStep_rad / step_rad));
      if (options.limits) path.angles = clamped(path.angles, box);
      path.gap_m = hand.move_to(path.angles);
      if (step_rad < kDone_rad) break;
      if (known != nullptr && largest_difference(path.angles, known->angles) < kSame_rad) {
        path = *known;
        return;
      }
    }
    if (path.gap_m < 0.0) return;
    path.cost = 0.0;
    for (std::size_t c = 0; c < target.size(); ++c) {
      const double by = path.angles[c] - target[c];
      path.cost += by * by / variance[c];
    }
  }

  // The nearest pose with gaps; infinite cost where none was found. Fingers that are deep in each
  // other can come apart on more than one side, so three starts are tried: the result of the
  // previous frame, the pose itself, and the pose with its fingers side by side. The cheapest is
  // taken, but the first one is kept unless another is far cheaper, so that the side does not
  // flicker (models/hand/README.md, "Sides and fallback").
  Path separate(const HandAngles& target, const HandAngles& variance) noexcept {
    Path best{.angles = target, .forces = forces};
    best.gap_m = hand.move_to(target);
    const bool is_deep = best.gap_m < -kDeep_m;
    if (best.gap_m >= options.margin_m) {
      best.cost = 0.0;
      best.forces = {};
      return best;
    }
    if (!is_deep) {
      descend(target, variance, best);
      return best;
    }
    Path same_side{.angles = before, .forces = forces};
    const Path* known = nullptr;
    if (follows) {
      descend(target, variance, same_side);
      if (std::isfinite(same_side.cost)) known = &same_side;
    }
    descend(target, variance, best, known);
    Path aside{.angles = target, .forces = {}};
    (void)retreat(parallel(target), aside.angles, kStartHalvings);
    descend(target, variance, aside, std::isfinite(best.cost) ? &best : known);
    if (aside.cost < best.cost) best = aside;
    return follows && same_side.cost * kLoyalty <= best.cost ? same_side : best;
  }

  // Moves `angles` towards `safe` to the first pose that has a gap, or to `safe` itself; returns
  // the gap.
  double retreat(const HandAngles& safe, HandAngles& angles, int halvings) noexcept {
    const HandAngles from = angles;
    double gap_m = hand.move_to(safe);
    angles = safe;
    if (gap_m < 0.0) return gap_m;
    double bad = 0.0;
    double good = 1.0;
    for (int i = 0; i < halvings; ++i) {
      const double middle = 0.5 * (bad + good);
      const HandAngles there = between(from, safe, middle);
      const double there_m = hand.move_to(there);
      if (there_m < kSliver_m) {
        bad = middle;
      } else {
        good = middle;
        gap_m = there_m;
        angles = there;
      }
    }
    return gap_m;
  }

  void keep_apart(HandAngles& angles, const HandAngles& variance,
                  ConstraintReport& report) noexcept {
    const Path path = separate(angles, variance);
    report.rounds = path.rounds;
    report.retreated = !std::isfinite(path.cost);
    if (report.retreated) {
      if (std::isfinite(path.gap_m)) angles = path.angles;
      HandAngles safe = parallel(angles);
      report.min_gap_m = retreat(safe, angles, kHalvings);
      if (report.min_gap_m < 0.0) {
        std::fill_n(safe.begin(), kFingerChannels, 0.0);  // all angles of the thumb, too
        report.min_gap_m = retreat(safe, angles, kHalvings);
      }
      if (report.min_gap_m < 0.0) report.min_gap_m = retreat({}, angles, kHalvings);
      forces = {};
    } else {
      angles = path.angles;
      forces = path.forces;
      report.min_gap_m = hand.move_to(angles);
    }
    follows = path.rounds > 0;
    before = angles;
  }

  int count_touching() noexcept {
    for (std::size_t p = 0; p < kPairs.size(); ++p) {
      touching[p] = forces[p] > 0.0 || (touching[p] && hand.gaps_m()[p] < options.leave_m);
    }
    return static_cast<int>(touching.count());
  }
};

ConstraintSolver::ConstraintSolver(const HandShape& shape, const ConstraintOptions& options)
    : ConstraintSolver(hand_geometry(shape), options) {}
ConstraintSolver::ConstraintSolver(const HandGeometry& geometry, const ConstraintOptions& options)
    : state_(std::make_unique<State>(geometry, options)) {}
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
  for (double& w : weight) w = std::max(w / most, kMinWeight);
  const HandGeometry& geometry = state.hand.geometry();
  if (state.options.limits) {
    for (std::size_t c = 0; c < angles.size(); ++c) {
      angles[c] =
          within(angles[c], geometry.low_rad[c], geometry.high_rad[c], state.options.soft_limits);
    }
  }
  if (state.options.collisions) {
    state.keep_apart(angles, weight, report);
    report.touching = state.count_touching();
  } else {
    report.min_gap_m = state.hand.move_to(angles);
  }
  report.changed_rad = largest_difference(angles, given);
  return report;
}

void ConstraintSolver::reset() noexcept {
  state_->forces = {};
  state_->touching.reset();
  state_->follows = false;
}

double min_gap_m(const HandGeometry& geometry, const HandAngles& angles) noexcept {
  return PlacedHand(geometry).move_to(angles);
}

}  // namespace posed::hand
