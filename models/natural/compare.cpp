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

// Limbs of two recordings of one person differ by less, those of two persons by more.
constexpr double kSameLimb = 0.01;

// What is known of a figure before any corpus.
struct Kind {
  bool low_is_bad = false;  // not only high values are not natural
  // How far persons are apart who move alike, as a share of the figure's median and at least: for
  // a corpus of so few persons that it does not say (models/natural/README.md, "Spread").
  double person_share = 0.0, person_least = 0.0;
  std::size_t persons = kMinPersons;  // so many do say it
};

constexpr Kind kJerk{.low_is_bad = true, .person_share = 0.6};
constexpr Kind kSparc{.low_is_bad = true, .person_share = 0.3};
constexpr Kind kFrechet{.person_least = 20000.0, .persons = 3};
constexpr Kind kBeyond{.person_least = 80.0};
constexpr Kind kSlide{.person_least = 4.0};
constexpr Kind kSink{.person_least = 7.0};

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
  // [channel], at least 0.
  [[nodiscard]] Eigen::VectorXd beyond_deg(const Figures& figures) const {
    return (low_deg - figures.low_deg).cwiseMax(figures.high_deg - high_deg).cwiseMax(0.0);
  }
};

// Figures that need other clips.
struct Against {
  double frechet = 0.0, beyond_deg = 0.0;
};

Against against(const Figures& figures, const motion::WindowSums& others, const Range& range,
                int dimensions) {
  return {motion::window_distance(figures.windows, others, dimensions),
          range.beyond_deg(figures).maxCoeff()};
}

double percentile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

// Adds the figure where enough of the corpus have it. A clip that lacks what all of them have (feet
// that stand, a speed) is not natural.
void place(std::string name, double value, std::vector<double> of_corpus, const Kind& kind,
           Comparison& comparison) {
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
  double room = std::max(placed.p95 - placed.p5, kMinRoom * std::abs(placed.median));
  if (comparison.persons > 0 && comparison.persons < kind.persons) {
    room = std::max({room, kind.person_share * std::abs(placed.median), kind.person_least});
  }
  placed.natural = value <= placed.p95 + room && (!kind.low_is_bad || value >= placed.p5 - room);
  comparison.figures.push_back(std::move(placed));
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

bool one_person(const Figures& a, const Figures& b) {
  const Eigen::VectorXd longest = a.limbs_m.cwiseMax(b.limbs_m);
  return ((a.limbs_m - b.limbs_m).cwiseAbs().array() <= kSameLimb * longest.array()).all();
}

// Which person each clip is of [clip], counted from 0; empty if a clip does not say.
std::vector<std::size_t> persons_of(const std::vector<Figures>& corpus) {
  std::vector<std::size_t> person(corpus.size());
  std::vector<std::size_t> first;  // [person] clip
  for (std::size_t i = 0; i < corpus.size(); ++i) {
    if (corpus[i].limbs_m.size() == 0) return {};
    const auto known = std::ranges::find_if(
        first, [&](std::size_t other) { return one_person(corpus[other], corpus[i]); });
    person[i] = static_cast<std::size_t>(known - first.begin());
    if (known == first.end()) first.push_back(i);
  }
  return person;
}

// Each clip of the corpus against those of the other persons, or, where these are not known or
// there is one, against the other clips.
std::optional<std::vector<TaskResult>> leave_one_out(const std::vector<Figures>& corpus,
                                                     const std::vector<std::size_t>& person,
                                                     const motion::WindowSums& all, int dimensions,
                                                     TaskRunner& tasks,
                                                     const CompareProgress& progress) {
  const bool by_person = std::ranges::any_of(person, [](std::size_t p) { return p > 0; });
  const Task task = [&](std::size_t i) -> TaskResult {
    motion::WindowSums others = all;
    Range range;
    for (std::size_t k = 0; k < corpus.size(); ++k) {
      const bool left_out = by_person ? person[k] == person[i] : k == i;
      if (left_out) others.subtract(corpus[k].windows);
      if (!left_out) range.add(corpus[k]);
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
  const std::vector<std::size_t> person = persons_of(corpus);
  if (!person.empty()) comparison.persons = *std::ranges::max_element(person) + 1;
  const auto found = leave_one_out(corpus, person, all, comparison.dimensions, tasks, progress);
  if (!found) return std::nullopt;
  std::vector<double> frechet, beyond_deg;
  for (const TaskResult& numbers : *found) {
    frechet.push_back(numbers[0]);
    beyond_deg.push_back(numbers[1]);
  }
  const Against own = against(clip, all, range, comparison.dimensions);
  range.beyond_deg(clip).maxCoeff(&comparison.furthest);
  place("jerk", clip.jerk, all_of(corpus, [](const Figures& f) { return f.jerk; }), kJerk,
        comparison);
  place("sparc", clip.sparc, all_of(corpus, [](const Figures& f) { return f.sparc; }), kSparc,
        comparison);
  place("frechet_deg2", own.frechet, std::move(frechet), kFrechet, comparison);
  place("beyond_deg", own.beyond_deg, std::move(beyond_deg), kBeyond, comparison);
  place("slide_cm_s", clip.slide_cm_s.value_or(kUnmeasured),
        all_of(corpus, [](const Figures& f) { return f.slide_cm_s.value_or(kUnmeasured); }), kSlide,
        comparison);
  place("sink_cm", clip.sink_cm.value_or(kUnmeasured),
        all_of(corpus, [](const Figures& f) { return f.sink_cm.value_or(kUnmeasured); }), kSink,
        comparison);
  return comparison;
}

}  // namespace posed::natural
