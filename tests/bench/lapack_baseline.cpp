#include "tests/bench/lapack_baseline.hpp"

#include <dlfcn.h>

#include <algorithm>

namespace posed::bench {

Result<LapackBaseline> LapackBaseline::load() {
  void* library = dlopen("liblapack.so.3", RTLD_NOW);  // stays loaded until the process ends
  void* found = library == nullptr ? nullptr : dlsym(library, "dpbsv_");
  if (found == nullptr) return fail("LAPACK is not installed: apt-get install liblapack3");
  return LapackBaseline(reinterpret_cast<Dpbsv>(found));
}

void LapackBaseline::solve(const trajectory::InformationForm& information, std::vector<double>& x) {
  using trajectory::Row;
  constexpr int kBand = 2;
  constexpr int kRows = kBand + 1;  // LAPACK's lower band storage, one column per frame
  const int frames = information.frames();
  bands_.resize(static_cast<std::size_t>(frames) * kRows);
  x.resize(static_cast<std::size_t>(frames) * static_cast<std::size_t>(information.channels()));
  for (int c = 0; c < information.channels(); ++c) {
    double* r = x.data() + static_cast<std::ptrdiff_t>(c) * frames;
    std::ranges::fill(bands_, 0.0);
    for (int t = 0; t < frames; ++t) {
      bands_[t * kRows] += information.row(t, Row::kPosition)[c];
      r[t] = information.row(t, Row::kPositionMean)[c];
    }
    for (int t = 1; t + 1 < frames; ++t) {
      const double p1 = 0.25 * information.row(t, Row::kDelta)[c];
      const double m1 = 0.5 * information.row(t, Row::kDeltaMean)[c];
      const double p2 = information.row(t, Row::kDeltaDelta)[c];
      const double m2 = information.row(t, Row::kDeltaDeltaMean)[c];
      double* band = bands_.data() + static_cast<std::ptrdiff_t>(t - 1) * kRows;
      band[0] += p1 + p2;
      band[1] -= 2.0 * p2;
      band[2] += p2 - p1;
      band[kRows] += 4.0 * p2;
      band[kRows + 1] -= 2.0 * p2;
      band[2 * kRows] += p1 + p2;
      r[t - 1] += m2 - m1;
      r[t] -= 2.0 * m2;
      r[t + 1] += m2 + m1;
    }
    constexpr int kOne = 1;
    int info = 0;
    dpbsv_("L", &frames, &kBand, &kOne, bands_.data(), &kRows, r, &frames, &info);
  }
}

}  // namespace posed::bench
