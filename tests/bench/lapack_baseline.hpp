// LAPACK as a baseline of the batch solve: one banded system per channel, solved by dpbsv. The
// library is loaded at run time, because only the benchmark uses it.
#pragma once

#include <vector>

#include "models/trajectory/information_form.hpp"
#include "proto/frame/result.hpp"

namespace posed::bench {

class LapackBaseline {
 public:
  // Returns an error when liblapack.so.3 is not installed.
  static Result<LapackBaseline> load();

  // The trajectory of every channel, [channel][frame], from the information of all frames.
  void solve(const trajectory::InformationForm& information, std::vector<double>& x);

 private:
  using Dpbsv = void (*)(const char* uplo, const int* n, const int* kd, const int* nrhs, double* ab,
                         const int* ldab, double* b, const int* ldb, int* info);
  explicit LapackBaseline(Dpbsv dpbsv) : dpbsv_(dpbsv) {}

  Dpbsv dpbsv_;
  std::vector<double> bands_;
};

}  // namespace posed::bench
