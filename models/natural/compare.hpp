// A clip's figures beside those that the clips of a corpus have themselves, each measured against
// the others (models/natural/README.md). Cold; thread-safe.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "models/natural/figures.hpp"
#include "models/tasks.hpp"

namespace posed::natural {

inline constexpr std::size_t kMinClips = 3;  // of a corpus; fewer have no spread
// With fewer persons than this in it, a corpus does not say how much people differ.
inline constexpr std::size_t kMinPersons = 10;

// One figure of the clip, and the distribution of the same figure over the corpus.
struct Placed {
  std::string name;    // jerk, sparc, frechet_deg2, beyond_deg, slide_cm_s, sink_cm
  double value = 0.0;  // NaN where the clip has none, though all of the corpus have one
  double p5 = 0.0, median = 0.0, p95 = 0.0;
  double below = 0.0;   // share of the corpus with a lower value
  bool natural = true;  // no further outside p5 to p95 than people differ; low may be good
};

struct Comparison {
  std::vector<Placed> figures;  // without those that the corpus does not have
  int dimensions = 0;           // of the features' distance
  Eigen::Index furthest = 0;    // channel that goes beyond_deg
  std::size_t persons = 0;      // of the corpus, told apart by their limbs; 0: unknown
};

// Receives the fraction done; returning false stops the work.
using CompareProgress = std::function<bool(double fraction)>;

// `corpus` has at least kMinClips. Where it has several persons, each clip is measured against
// those of the others. Each clip of it is a task. Nothing where `progress` asked to stop.
[[nodiscard]] std::optional<Comparison> compare(const Figures& clip,
                                                const std::vector<Figures>& corpus,
                                                TaskRunner& tasks, const CompareProgress& progress);

}  // namespace posed::natural
