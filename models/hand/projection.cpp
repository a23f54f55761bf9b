#include "models/hand/projection.hpp"

#include <algorithm>
#include <cmath>

#include "models/hand/nonnegative.hpp"

namespace posed::hand {
namespace {

constexpr int kMaxNewtonSteps = 12;
constexpr int kMaxCycles = 30;        // of sweeps and Newton steps
constexpr double kStill_rad = 1e-7;   // a sweep that moves no angle farther is the last one
constexpr double kFlat = 1e-18;       // A V A' of a row that moves nothing
constexpr double kRidge = 1e-10;      // of the largest diagonal: rows may depend on each other
constexpr double kMaxPush_rad = 8.0;  // no force alone pushes an angle farther
constexpr double kMet_m = 1e-8;       // a constraint that lacks less holds
constexpr double kTorn_m = 1e-6;      // constraints that lack more contradict each other
constexpr int kMaxHalvings = 4;

// [row][angle], each angle scaled by the root of its variance; no heap.
using Slopes = Eigen::Matrix<double, Eigen::Dynamic, kHandChannels, Eigen::RowMajor, kMaxRows>;
static_assert(kMaxRows <= kMaxUnknowns);
using RowForces = std::array<double, kMaxRows>;

// f(angle, slope) for the angles of the row's fingers.
template <typename F>
void for_each_slope(const Row& row, const F& f) noexcept {
  for (int i = 0; i < kFingerChannels; ++i) f(kFingerChannels * row.finger_a + i, row.slope.a[i]);
  for (int i = 0; i < kFingerChannels; ++i) f(kFingerChannels * row.finger_b + i, row.slope.b[i]);
}

// The dual problem: the forces decide the pose, y = clamp(target + V A' force). All RT-safe.
class Dual {
 public:
  Dual(const HandAngles& target, const HandAngles& variance, std::span<const Row> rows,
       const Box* box) noexcept
      : target_(target), variance_(variance), rows_(rows), box_(box) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      double sum = 0.0;
      double push = 0.0;
      for_each_slope(rows[r], [&](int c, double slope) {
        sum += slope * slope * variance[c];
        push = std::max(push, std::abs(slope) * variance[c]);
      });
      if (sum <= kFlat) continue;
      ease_[r] = 1.0 / sum;
      most_[r] = kMaxPush_rad / push;
    }
  }

  void begin(const RowForces& start) noexcept {
    RowForces force{};
    for (std::size_t r = 0; r < rows_.size(); ++r) force[r] = bounded(r, start[r]);
    set(force);
  }

  // Changes one force after the other to its best value. Returns the largest move of an angle.
  [[nodiscard]] double sweep() noexcept {
    double moved_rad = 0.0;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const double change = bounded(r, force_[r] + lacks(r) * ease_[r]) - force_[r];
      if (change == 0.0) continue;
      force_[r] += change;
      for_each_slope(rows_[r], [&](int c, double slope) {
        free_[c] += change * variance_[c] * slope;
        const double before = pose_[c];
        pose_[c] = within(c);
        moved_rad = std::max(moved_rad, std::abs(pose_[c] - before));
      });
    }
    return moved_rad;
  }

  // Changes all forces that count at once, to the best values if neither the rows that count nor
  // the angles at their limits changed; as far as the dual value grows.
  void newton() noexcept {
    std::array<std::size_t, kMaxRows> active{};
    int count = 0;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if ((force_[r] > 0.0 || lacks(r) > 0.0) && is_free(r)) active[count++] = r;
    }
    if (count < 2) return;  // a sweep solves that
    Slopes slopes = Slopes::Zero(count, kHandChannels);
    SmallVector lack(count), force(count);
    for (int i = 0; i < count; ++i) {
      force[i] = force_[active[i]];
      lack[i] = lacks(active[i]);
      for_each_slope(rows_[active[i]], [&](int c, double slope) {
        if (pose_[c] == free_[c]) slopes(i, c) = slope * std::sqrt(variance_[c]);
      });
    }
    SmallMatrix curvature = slopes.lazyProduct(slopes.transpose());
    curvature.diagonal().array() += kRidge * curvature.diagonal().maxCoeff();
    SmallVector best = force;
    const SmallVector pull = lack + curvature.lazyProduct(force);
    static_cast<void>(solve_nonnegative(curvature, pull, best));  // else it is no worse
    try_step(active, best - force);
  }

  // Whether no force holds back what would hold by itself. At the limits of angles a force may be
  // far too large without any effect on the pose.
  [[nodiscard]] bool is_settled() const noexcept {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (force_[r] > 0.0 && lacks(r) < -kMet_m) return false;
    }
    return true;
  }
  // Whether some constraints contradict each other or the box: then the forces mean nothing.
  [[nodiscard]] bool is_torn() const noexcept {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (lacks(r) > kTorn_m) return true;
    }
    return false;
  }

  [[nodiscard]] const RowForces& forces() const noexcept { return force_; }
  [[nodiscard]] const HandAngles& pose() const noexcept { return pose_; }

 private:
  void set(const RowForces& force) noexcept {
    force_ = force;
    free_ = target_;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (force[r] == 0.0) continue;
      for_each_slope(rows_[r],
                     [&](int c, double slope) { free_[c] += force[r] * variance_[c] * slope; });
    }
    for (int c = 0; c < kHandChannels; ++c) pose_[c] = within(c);
  }

  void try_step(const std::array<std::size_t, kMaxRows>& active, const SmallVector& step) noexcept {
    const RowForces before = force_;
    const double value_before = value();
    double share = 1.0;
    for (int i = 0; i < kMaxHalvings; ++i, share *= 0.5) {
      RowForces next = before;
      for (Eigen::Index k = 0; k < step.size(); ++k) {
        double& force = next[active[k]];
        force = bounded(active[k], force + share * step[k]);
      }
      set(next);
      if (value() >= value_before - 1e-13 * std::abs(value_before)) return;
    }
    set(before);
  }

  [[nodiscard]] double bounded(std::size_t r, double force) const noexcept {
    return std::clamp(force, 0.0, most_[r]);
  }

  // Whether the row can move an angle that is not at its limit.
  [[nodiscard]] bool is_free(std::size_t r) const noexcept {
    double sum = 0.0;
    for_each_slope(rows_[r], [&](int c, double slope) {
      if (pose_[c] == free_[c]) sum += slope * slope * variance_[c];
    });
    return sum > kFlat;
  }

  // How much the row's constraint lacks at the pose; below zero: nothing.
  [[nodiscard]] double lacks(std::size_t r) const noexcept {
    double lack = rows_[r].least;
    for_each_slope(rows_[r], [&](int c, double slope) { lack -= slope * pose_[c]; });
    return lack;
  }

  [[nodiscard]] double value() const noexcept {
    double sum = 0.0;
    for (int c = 0; c < kHandChannels; ++c) {
      const double by = pose_[c] - target_[c];
      sum += 0.5 * by * by / variance_[c];
    }
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (force_[r] > 0.0) sum += force_[r] * lacks(r);
    }
    return sum;
  }

  [[nodiscard]] double within(int c) const noexcept {
    return box_ == nullptr ? free_[c] : std::clamp(free_[c], box_->low_rad[c], box_->high_rad[c]);
  }

  const HandAngles& target_;
  const HandAngles& variance_;
  std::span<const Row> rows_;
  const Box* box_;
  std::array<double, kMaxRows> ease_{};  // 1 / (A V A') of each row; 0: it moves no angle
  RowForces most_{};
  RowForces force_{};
  HandAngles free_{};  // the pose without the box
  HandAngles pose_{};
};

// False: the forces have not come to rest.
bool settle(Dual& dual) noexcept {
  for (int cycle = 0; cycle < kMaxCycles; ++cycle) {
    if (dual.sweep() < kStill_rad && dual.is_settled()) return true;
    if (cycle < kMaxNewtonSteps) dual.newton();
  }
  return false;
}

}  // namespace

HandAngles project(const HandAngles& target, const HandAngles& variance, std::span<const Row> rows,
                   const Box* box, Forces& forces) noexcept {
  Dual dual(target, variance, rows, box);
  RowForces start{};
  for (std::size_t r = 0; r < rows.size(); ++r) start[r] = forces[rows[r].pair];
  dual.begin(start);
  if (!settle(dual)) {  // the forces of the call before mislead
    dual.begin({});
    static_cast<void>(settle(dual));
  }
  forces = {};
  if (dual.is_torn()) return dual.pose();
  for (std::size_t r = 0; r < rows.size(); ++r) forces[rows[r].pair] = dual.forces()[r];
  return dual.pose();
}

}  // namespace posed::hand
