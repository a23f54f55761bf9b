#include "models/natural/compare.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace posed::natural {
namespace {

constexpr int kMaxDimensions = 20;
constexpr double kMinRoom = 0.1;  // of the median: a corpus of near-copies has no width
constexpr double kUnmeasured = std::numeric_limits<double>::quiet_NaN();

// Which values of a figure are not natural: only high ones, or low ones, too.
enum class Bad : std::uint8_t { kHigh, kEither };

// The range of each channel over several clips.
struct Range {
  Eigen::VectorXd low_deg, high_deg;

  void add(const Figures& figures) {
    if (low_deg.size() == 0) {
      low_deg = figures.low_deg;
      high_deg = figures.high_deg;
      return;
    }
    low_deg = low_deg.cwiseMin(figures.low_deg);
    high_deg = high_deg.cwiseMax(figures.high_deg);
  }
  [[nodiscard]] double beyond_deg(const Figures& figures) const {
    return std::max(
        {0.0, (low_deg - figures.low_deg).maxCoeff(), (figures.high_deg - high_deg).maxCoeff()});
  }
};

// Figures that need other clips.
struct Against {
  double frechet = 0.0, beyond_deg = 0.0;
};

Against against(const Figures& figures, const motion::WindowSums& others, const Range& range,
                int dimensions) {
  return {motion::window_distance(figures.windows, others, dimensions), range.beyond_deg(figures)};
}

double percentile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

// Adds the figure where enough of the corpus have it. A clip that lacks what all of them have (feet
// that stand, a speed) is not natural.
void place(std::string name, double value, std::vector<double> of_corpus, Bad bad,
           std::vector<Placed>& figures) {
  const std::size_t before = of_corpus.size();
  std::erase_if(of_corpus, [](double x) { return !std::isfinite(x); });
  const bool all_have = of_corpus.size() == before;
  if (of_corpus.size() < kMinClips || (!std::isfinite(value) && !all_have)) return;
  std::ranges::sort(of_corpus);
  Placed placed{.name = std::move(name),
                .value = value,
                .p5 = percentile(of_corpus, 0.05),
                .median = percentile(of_corpus, 0.5),
                .p95 = percentile(of_corpus, 0.95)};
  const auto lower = std::ranges::lower_bound(of_corpus, value) - of_corpus.begin();
  placed.below = static_cast<double>(lower) / static_cast<double>(of_corpus.size());
  const double room = std::max(placed.p95 - placed.p5, kMinRoom * std::abs(placed.median));
  placed.natural = value <= placed.p95 + room && (bad == Bad::kHigh || value >= placed.p5 - room);
  figures.push_back(std::move(placed));
}

template <typename Member>
std::vector<double> all_of(const std::vector<Figures>& corpus, Member member) {
  std::vector<double> values(corpus.size());
  std::ranges::transform(corpus, values.begin(), member);
  return values;
}

int shared_dimensions(const Figures& clip, const std::vector<Figures>& corpus) {
  double fewest = clip.windows.count;
  for (const Figures& figures : corpus) fewest = std::min(fewest, figures.windows.count);
  return std::min({kMaxDimensions, motion::most_dimensions(fewest),
                   static_cast<int>(clip.windows.first.size())});
}

// Each clip of the corpus against the others.
std::optional<std::vector<TaskResult>> leave_one_out(const std::vector<Figures>& corpus,
                                                     const motion::WindowSums& all, int dimensions,
                                                     TaskRunner& tasks,
                                                     const CompareProgress& progress) {
  const Task task = [&](std::size_t i) -> TaskResult {
    motion::WindowSums others = all;
    others.subtract(corpus[i].windows);
    Range range;
    for (std::size_t k = 0; k < corpus.size(); ++k) {
      if (k != i) range.add(corpus[k]);
    }
    const Against found = against(corpus[i], others, range, dimensions);
    return {found.frechet, found.beyond_deg};
  };
  return tasks.run(corpus.size(), task, [&](std::size_t done) {
    return !progress || progress(static_cast<double>(done) / static_cast<double>(corpus.size()));
  });
}

}  // namespace

std::optional<Comparison> compare(const Figures& clip, const std::vector<Figures>& corpus,
                                  TaskRunner& tasks, const CompareProgress& progress) {
  assert(corpus.size() >= kMinClips);
  Comparison comparison;
  comparison.dimensions = shared_dimensions(clip, corpus);
  motion::WindowSums all;
  Range range;
  for (const Figures& figures : corpus) {
    all.add(figures.windows);
    range.add(figures);
  }
  const auto found = leave_one_out(corpus, all, comparison.dimensions, tasks, progress);
  if (!found) return std::nullopt;
  std::vector<double> frechet, beyond_deg;
  for (const TaskResult& numbers : *found) {
    frechet.push_back(numbers[0]);
    beyond_deg.push_back(numbers[1]);
  }
  const Against own = against(clip, all, range, comparison.dimensions);
  auto& figures = comparison.figures;
  place("jerk", clip.jerk, all_of(corpus, [](const Figures& f) { return f.jerk; }), Bad::kEither,
        figures);
  place("sparc", clip.sparc, all_of(corpus, [](const Figures& f) { return f.sparc; }), Bad::kEither,
        figures);
  place("frechet_deg2", own.frechet, std::move(frechet), Bad::kHigh, figures);
  place("beyond_deg", own.beyond_deg, std::move(beyond_deg), Bad::kHigh, figures);
  place("slide_cm_s", clip.slide_cm_s.value_or(kUnmeasured),
        all_of(corpus, [](const Figures& f) { return f.slide_cm_s.value_or(kUnmeasured); }),
        Bad::kHigh, figures);
  place("sink_cm", clip.sink_cm.value_or(kUnmeasured),
        all_of(corpus, [](const Figures& f) { return f.sink_cm.value_or(kUnmeasured); }),
        Bad::kHigh, figures);
  return comparison;
}

}  // namespace posed::natural
