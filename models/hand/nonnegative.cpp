#include "models/hand/nonnegative.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed::hand {
namespace {

// The unknowns that may differ from zero.
struct Support {
  std::array<int, kMaxUnknowns> index{};
  int count = 0;

  void add(int i) noexcept { index[count++] = i; }
  void keep_positive(const SmallVector& x) noexcept {
    const auto end =
        std::remove_if(index.begin(), index.begin() + count, [&](int i) { return x[i] <= 0.0; });
    count = static_cast<int>(end - index.begin());
  }
  [[nodiscard]] bool has(int i) const noexcept {
    return std::find(index.begin(), index.begin() + count, i) != index.begin() + count;
  }
  [[nodiscard]] int operator[](int k) const noexcept { return index[k]; }
};

// H x = c on the support alone, by Cholesky; `wanted` is zero elsewhere. False: not positive.
bool solve_on(const Support& support, const SmallMatrix& H, const SmallVector& c, SmallMatrix& L,
              SmallVector& wanted) noexcept {
  wanted.setZero();
  for (int i = 0; i < support.count; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = H(support[i], support[j]);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      if (i == j && !(sum > 0.0)) return false;
      L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
    }
  }
  for (int i = 0; i < support.count; ++i) {
    double sum = c[support[i]];
    for (int k = 0; k < i; ++k) sum -= L(i, k) * wanted[support[k]];
    wanted[support[i]] = sum / L(i, i);
  }
  for (int i = support.count - 1; i >= 0; --i) {
    double sum = wanted[support[i]];
    for (int k = i + 1; k < support.count; ++k) sum -= L(k, i) * wanted[support[k]];
    wanted[support[i]] = sum / L(i, i);
  }
  return true;
}

// Moves `x` towards `wanted` until the first of the support is zero. True: it arrived.
bool move_to(const SmallVector& wanted, const Support& support, SmallVector& x) noexcept {
  double share = 1.0;
  for (int k = 0; k < support.count; ++k) {
    const int i = support[k];
    if (wanted[i] < 0.0) share = std::min(share, x[i] / (x[i] - wanted[i]));
  }
  for (int k = 0; k < support.count; ++k) {
    const int i = support[k];
    const bool blocks = wanted[i] < 0.0 && x[i] / (x[i] - wanted[i]) <= share;
    x[i] = blocks ? 0.0 : x[i] + share * (wanted[i] - x[i]);
  }
  return share >= 1.0;
}

}  // namespace

bool solve_nonnegative(const SmallMatrix& H, const SmallVector& c, SmallVector& x) noexcept {
  const int size = static_cast<int>(c.size());
  SmallMatrix L(size, size);
  SmallVector wanted(size);
  Support support;
  for (int i = 0; i < size; ++i) support.add(i);
  const int most = 2 * size + 10;
  for (int turn = 0; turn < most; ++turn) {
    if (!solve_on(support, H, c, L, wanted)) return false;
    if (!move_to(wanted, support, x)) {
      support.keep_positive(x);
      continue;
    }
    // Optimal unless one outside of the support wants to grow.
    const double least = 1e-12 * c.cwiseAbs().maxCoeff();
    int grows = -1;
    double most_slope = least;
    for (int i = 0; i < size; ++i) {
      if (support.has(i)) continue;
      const double slope = c[i] - H.row(i).dot(x);
      if (slope > most_slope) {
        most_slope = slope;
        grows = i;
      }
    }
    if (grows < 0) return true;
    support.add(grows);
  }
  return false;
}

}  // namespace posed::hand
