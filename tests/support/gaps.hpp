// Cuts dropouts into a motion and measures an estimate inside them against holding the last value.
#pragma once

#include <limits>
#include <vector>

#include "tests/support/grasps.hpp"

namespace posed::test {

struct Gaps {
  Motion measured;            // NaN inside the gaps
  std::vector<bool> missing;  // [frames]
};

// Gaps of `length` frames, 35 to 55 frames apart; none at the start and the end.
inline Gaps with_gaps(const Motion& measured, int length, unsigned seed) {
  Gaps gaps{measured, std::vector<bool>(static_cast<std::size_t>(measured.rows()))};
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<Eigen::Index> apart(35, 54);
  for (Eigen::Index t = 45; t < measured.rows() - 20; t += length + apart(random)) {
    for (Eigen::Index i = t; i < std::min(t + length, measured.rows()); ++i) {
      gaps.measured.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
      gaps.missing[static_cast<std::size_t>(i)] = true;
    }
  }
  return gaps;
}

// Mean square errors inside the gaps; every added motion has the same weight.
class GapError {
 public:
  void add(const Motion& truth, const Motion& estimate, const Gaps& gaps) {
    double square = 0.0;
    double held_square = 0.0;
    double values = 0.0;
    Eigen::Index last = 0;
    for (Eigen::Index t = 0; t < truth.rows(); ++t) {
      if (!gaps.missing[static_cast<std::size_t>(t)]) {
        last = t;
        continue;
      }
      square += (estimate.row(t) - truth.row(t)).squaredNorm();
      held_square += (gaps.measured.row(last) - truth.row(t)).squaredNorm();
      values += static_cast<double>(truth.cols());
    }
    ours_ += square / values;
    held_ += held_square / values;
    ++motions_;
  }
  [[nodiscard]] double ours_deg() const { return std::sqrt(ours_ / motions_); }
  [[nodiscard]] double held_deg() const { return std::sqrt(held_ / motions_); }

 private:
  double ours_ = 0.0, held_ = 0.0;
  int motions_ = 0;
};

}  // namespace posed::test
