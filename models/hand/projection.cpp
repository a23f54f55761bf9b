#include "models/hand/projection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace posed::hand {
namespace {

constexpr int kMaxSweeps = 200;
constexpr double kStill_rad = 1e-8;  // a sweep that moves no angle farther is the last one

// Updates one constraint at a time. RT-safe.
class Solver {
 public:
  Solver(const HandAngles& variance, HandAngles& y) noexcept : variance_(variance), y_(y) {}

  void push(const Row& row, double force) noexcept {
    for_each_slope(
        row, [&](int channel, double slope) { move(channel, force * variance_[channel] * slope); });
  }

  // 1 / (A variance A') of a row.
  [[nodiscard]] double ease(const Row& row) const noexcept {
    double sum = 0.0;
    for_each_slope(row,
                   [&](int channel, double slope) { sum += slope * slope * variance_[channel]; });
    return sum > 1e-18 ? 1.0 / sum : 0.0;
  }

  void relax(const Row& row, double ease, double& force) noexcept {
    double value = 0.0;
    for_each_slope(row, [&](int channel, double slope) { value += slope * y_[channel]; });
    const double change = std::max(-force, (row.least - value) * ease);
    force += change;
    if (change != 0.0) push(row, change);
  }

  void relax_box(const Box& box, Forces& forces) noexcept {
    for (int c = 0; c < kHandChannels; ++c) {
      const double up = std::max(-forces.low[c], (box.low_rad[c] - y_[c]) / variance_[c]);
      forces.low[c] += up;
      move(c, up * variance_[c]);
      const double down = std::max(-forces.high[c], (y_[c] - box.high_rad[c]) / variance_[c]);
      forces.high[c] += down;
      move(c, -down * variance_[c]);
    }
  }

  // Largest move since the last call.
  [[nodiscard]] double moved() noexcept { return std::exchange(moved_, 0.0); }

 private:
  template <typename F>
  static void for_each_slope(const Row& row, const F& f) noexcept {
    for (int i = 0; i < kFingerChannels; ++i) {
      f(kFingerChannels * row.finger_a + i, row.slope.a[i]);
    }
    for (int i = 0; i < kFingerChannels; ++i) {
      f(kFingerChannels * row.finger_b + i, row.slope.b[i]);
    }
  }

  void move(int channel, double by_rad) noexcept {
    y_[channel] += by_rad;
    moved_ = std::max(moved_, std::abs(by_rad));
  }

  const HandAngles& variance_;
  HandAngles& y_;
  double moved_ = 0.0;
};

}  // namespace

HandAngles project(const HandAngles& target, const HandAngles& variance, std::span<const Row> rows,
                   const Box* box, Forces& forces) noexcept {
  HandAngles y = target;
  Solver solver(variance, y);
  std::array<double, kMaxRows> ease{};
  std::array<double, kBonePairs> kept{};
  for (std::size_t r = 0; r < rows.size(); ++r) {
    ease[r] = solver.ease(rows[r]);
    kept[rows[r].pair] = forces.contact[rows[r].pair];
    solver.push(rows[r], kept[rows[r].pair]);
  }
  forces.contact = kept;
  if (box != nullptr) {
    for (int c = 0; c < kHandChannels; ++c) y[c] += variance[c] * (forces.low[c] - forces.high[c]);
  }
  (void)solver.moved();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      solver.relax(rows[r], ease[r], forces.contact[rows[r].pair]);
    }
    if (box != nullptr) solver.relax_box(*box, forces);
    if (solver.moved() < kStill_rad) break;
  }
  return y;
}

}  // namespace posed::hand
