#include "models/robot/step_program.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "models/hand/nonnegative.hpp"

namespace posed::robot {
namespace {

constexpr int kMaxActive = hand::kMaxUnknowns;
constexpr int kJoinAtOnce = 6;
constexpr int kMaxRounds = 24;
constexpr double kRidge = 1e-6;   // rows that say the same share their force
constexpr double kKept = 1e-7;    // of a row scaled to a step of one
constexpr double kBroken = 1e-5;  // no rounding any more

// A side of the box (index 2i: low, 2i + 1: high) or a row (2 size + r), scaled.
struct Active {
  int index = 0;
  double scale = 1.0, least = 0.0;
  Drive slope;
  Drive moves;  // H^-1 slope
};

class Solver {
 public:
  explicit Solver(const StepProgram& program) : p_(program) {}

  bool solve(Drive& step) noexcept {
    if (!factor()) {
      step.setZero();
      return false;
    }
    free_ = -inverse(p_.g);
    step = free_;
    for (int round = 0; round < kMaxRounds && join(step); ++round) {
      if (!find_forces()) break;
      step = free_;
      for (int k = 0; k < count_; ++k) step += force_[k] * active_[k].moves;
    }
    for (int i = 0; i < kMaxDriven; ++i) {
      step[i] = i < p_.size ? std::clamp(step[i], p_.low[i], p_.high[i]) : 0.0;
    }
    return std::ranges::all_of(p_.rows, [&](const StepRow& row) {
      return row.slope.dot(step) >= row.least - kBroken * std::max(row.slope.norm(), 1e-3);
    });
  }

 private:
  // Column by column: what a row's sum takes comes in the same order as row by row, but rows do not
  // wait for each other.
  bool factor() noexcept {
    const int n = p_.size;
    for (int j = 0; j < n; ++j) {
      L_.col(j).segment(j, n - j) = p_.H.col(j).segment(j, n - j);
    }
    for (int k = 0; k < n; ++k) {
      if (!(L_(k, k) > 0.0)) return false;
      L_(k, k) = std::sqrt(L_(k, k));
      for (int i = k + 1; i < n; ++i) L_(i, k) /= L_(k, k);
      for (int j = k + 1; j < n; ++j) {
        for (int i = j; i < n; ++i) L_(i, j) -= L_(i, k) * L_(j, k);
      }
    }
    return true;
  }

  [[nodiscard]] Drive inverse(const Drive& right) const noexcept {
    Drive x = right;
    x.tail(kMaxDriven - p_.size).setZero();
    for (int k = 0; k < p_.size; ++k) {
      if (x[k] == 0.0) continue;
      x[k] /= L_(k, k);
      for (int i = k + 1; i < p_.size; ++i) x[i] -= L_(i, k) * x[k];
    }
    for (int i = p_.size - 1; i >= 0; --i) {
      double sum = x[i];
      for (int k = i + 1; k < p_.size; ++k) sum -= L_(k, i) * x[k];
      x[i] = sum / L_(i, i);
    }
    return x;
  }

  [[nodiscard]] int constraints() const noexcept {
    return 2 * p_.size + static_cast<int>(p_.rows.size());
  }

  // How far a constraint is broken, as a step.
  [[nodiscard]] double broken(int index, const Drive& step) const noexcept {
    if (index < 2 * p_.size) {
      const int i = index / 2;
      return index % 2 == 0 ? p_.low[i] - step[i] : step[i] - p_.high[i];
    }
    const StepRow& row = p_.rows[index - 2 * p_.size];
    const double size = row.slope.norm();
    return size > 1e-9 ? (row.least - row.slope.dot(step)) / size : 0.0;
  }

  [[nodiscard]] bool is_active(int index) const noexcept {
    return std::any_of(active_.begin(), active_.begin() + count_,
                       [index](const Active& a) { return a.index == index; });
  }

  // Constraints that are broken most join; those without a force leave. False: nothing to add.
  bool join(const Drive& step) noexcept {
    std::array<int, kJoinAtOnce> worst{};
    std::array<double, kJoinAtOnce> by{};
    int found = 0;
    for (int index = 0; index < constraints(); ++index) {
      double much = broken(index, step);
      if (much <= kKept || is_active(index)) continue;
      int at = index;
      for (int k = 0; k < found; ++k) {
        if (much <= by[k]) continue;
        std::swap(much, by[k]);
        std::swap(at, worst[k]);
      }
      if (found == kJoinAtOnce) continue;
      by[found] = much;
      worst[found++] = at;
    }
    if (found == 0) return false;
    int kept = 0;
    for (int k = 0; k < count_; ++k) {
      if (force_[k] <= 0.0) continue;
      if (kept != k) active_[kept] = active_[k];
      force_[kept++] = force_[k];
    }
    count_ = kept;
    for (int k = 0; k < found && count_ < kMaxActive; ++k) add(worst[k]);
    return true;
  }

  void add(int index) noexcept {
    Active& active = active_[count_];
    active.index = index;
    if (index < 2 * p_.size) {
      const int i = index / 2;
      const double sign = index % 2 == 0 ? 1.0 : -1.0;
      active.slope.setZero();
      active.slope[i] = sign;
      active.least = sign * (index % 2 == 0 ? p_.low[i] : p_.high[i]);
    } else {
      const StepRow& row = p_.rows[index - 2 * p_.size];
      active.slope = row.slope;
      active.least = row.least;
    }
    active.moves = inverse(active.slope);
    active.scale = 1.0 / std::sqrt(std::max(active.slope.dot(active.moves), 1e-18));
    active.slope *= active.scale;
    active.moves *= active.scale;
    active.least *= active.scale;
    force_[count_++] = 0.0;
  }

  bool find_forces() noexcept {
    hand::SmallMatrix G(count_, count_);
    hand::SmallVector c(count_), x(count_);
    for (int k = 0; k < count_; ++k) {
      for (int l = 0; l <= k; ++l) G(k, l) = G(l, k) = active_[k].slope.dot(active_[l].moves);
      G(k, k) += kRidge;
      c[k] = active_[k].least - active_[k].slope.dot(free_);
      x[k] = force_[k];
    }
    const bool solved = hand::solve_nonnegative(G, c, x);
    for (int k = 0; k < count_; ++k) force_[k] = x[k];
    return solved && x.allFinite();
  }

  const StepProgram& p_;
  Metric L_;  // its lower part alone
  Drive free_ = Drive::Zero();
  std::array<Active, kMaxActive> active_;  // no need to clear 17 kB
  std::array<double, kMaxActive> force_{};
  int count_ = 0;
};

}  // namespace

bool solve(const StepProgram& program, Drive& step) noexcept { return Solver(program).solve(step); }

}  // namespace posed::robot
