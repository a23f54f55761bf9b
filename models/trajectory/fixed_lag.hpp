// FixedLag: the trajectory solver as a stream (models/trajectory/README.md, "Fixed lag"). It
// accepts the rows of an InformationForm frame by frame; `lag` frames later it gives exactly the
// estimate of a solve over the whole past and those `lag` frames. The past is eliminated only once,
// so a frame costs three eliminations and `lag` steps back. No allocation after construction; one
// thread.
#pragma once

#include <array>
#include <vector>

#include "models/trajectory/information_form.hpp"
#include "models/trajectory/pentadiagonal.hpp"

namespace posed::trajectory {

class FixedLag {
 public:
  FixedLag(int channels, int lag);

  // Adds the next frame; its rows are copied.
  RT_SAFE void push(const double* information) noexcept;

  // The estimate of the frame `back` frames before the last pushed one, given all pushed frames;
  // `back` from 0 to min(lag, pushed() - 1). After push(), estimate(lag) is the stream's output; at
  // the end of the sequence, `back` = lag - 1 down to 0 gives the remaining frames. x, variance:
  // [stride()], 64-byte aligned; variance may be null.
  RT_SAFE void estimate(int back, double* x, double* variance) noexcept;

  [[nodiscard]] int lag() const noexcept { return lag_; }
  [[nodiscard]] int stride() const noexcept { return recent_.stride(); }
  [[nodiscard]] long pushed() const noexcept { return pushed_; }

 private:
  static constexpr int kOpen = 3;  // the last frames, some of whose windows need later frames

  int lag_;
  long pushed_ = 0;
  InformationForm recent_;                 // ring of kOpen frames
  std::array<const double*, kOpen> tail_;  // the same frames, oldest first
  Rows carry_, factor_rows_, x_;
  std::vector<double*> factors_;  // the last frames' factors, oldest first
};

}  // namespace posed::trajectory
