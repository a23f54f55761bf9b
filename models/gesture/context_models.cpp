#include "models/gesture/context_models.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "models/gesture/estimate.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/task_numbers.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

// Receives the first of the frames that one segment was aligned with, the state probabilities of
// each of them, and the expected stays.
using PartFunction =
    std::function<void(std::size_t segment, Eigen::Index first_frame, const Eigen::MatrixXd& gamma,
                       const Eigen::VectorXd& stays)>;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Segments [first, last) that touch one another, with all their frames.
class Chain {
 public:
  Chain(const FeatureMatrix& features, const std::vector<Segment>& segments,
        const std::vector<const StateModel*>& models, std::size_t first, std::size_t last,
        int slack)
      : features_(features), segments_(segments), models_(models), first_(first), last_(last) {
    begin_ = segments[first].begin;
    frames_ = segments[last - 1].end - begin_;
    set_band(slack);
  }

  double align(const PartFunction& accept) const {
    const auto count = static_cast<Index>(last_ - first_);
    MatrixXd density(frames_, band_.width);
    VectorXd stay(count * kStates);
    for (Index s = 0; s < count; ++s) {
      const StateModel& model = *models_[first_ + s];
      stay.segment(s * kStates, kStates) = model.stay;
      const auto [from, to] = reach(s);
      const MatrixXd part = log_density(rows(from, to), model);
      for (int t = from; t < to; ++t) {
        density.row(t).segment(column(s, t), kStates) = part.row(t - from);
      }
    }
    const Posterior posterior = forward_backward(density, stay, band_);
    for (Index s = 0; s < count; ++s) {
      const auto [from, to] = reach(s);
      MatrixXd gamma(to - from, kStates);
      for (int t = from; t < to; ++t) {
        gamma.row(t - from) = posterior.gamma.row(t).segment(column(s, t), kStates);
      }
      accept(first_ + s, begin_ + from, gamma, posterior.stays.segment(s * kStates, kStates));
    }
    return posterior.log_likelihood;
  }

 private:
  // Frame t, counted from the chain's start, may be in any segment at most `slack` frames away.
  void set_band(int slack) {
    const auto count = static_cast<int>(last_ - first_);
    std::vector<int> lowest;
    for (int t = 0, low = 0, high = 0; t < frames_; ++t) {
      while (low + 1 < count && segments_[first_ + low].end - begin_ + slack <= t) ++low;
      while (high + 1 < count && segments_[first_ + high + 1].begin - begin_ - slack <= t) ++high;
      lowest.push_back(low);
      band_.width = std::max(band_.width, (high - low + 1) * kStates);
    }
    const int last_start = count * kStates - band_.width;
    for (const int low : lowest) band_.first.push_back(std::min(low * kStates, last_start));
  }

  // The frames [from, to) whose band holds segment s.
  [[nodiscard]] std::pair<int, int> reach(Index s) const {
    const auto lowest = static_cast<int>(s * kStates) + kStates - band_.width;
    const auto from = std::ranges::lower_bound(band_.first, lowest);
    const auto to = std::ranges::upper_bound(band_.first, static_cast<int>(s * kStates));
    return {static_cast<int>(from - band_.first.begin()),
            static_cast<int>(to - band_.first.begin())};
  }

  [[nodiscard]] Index column(Index s, int t) const { return s * kStates - band_.first[t]; }

  [[nodiscard]] Frames rows(int from, int to) const {
    return features_.middleRows(begin_ + from, to - from);
  }

  const FeatureMatrix& features_;
  const std::vector<Segment>& segments_;
  const std::vector<const StateModel*>& models_;
  std::size_t first_, last_;
  int begin_ = 0, frames_ = 0;
  Band band_;
};

// One round of alignment over a whole recording: the models of successive labels are chained and
// aligned with all frames that the labels cover, so that the labels' borders are only hints
// (models/gesture/README.md, "Embedded rounds"). `models` has one model per segment; a border moves
// by at most `slack` frames. Segments that do not touch are aligned separately. Returns the log
// likelihood of the whole recording.
double align_embedded(const FeatureMatrix& features, const std::vector<Segment>& segments,
                      const std::vector<const StateModel*>& models, int slack,
                      const PartFunction& accept) {
  double log_likelihood = 0.0;
  for (std::size_t first = 0; first < segments.size();) {
    std::size_t last = first + 1;
    while (last < segments.size() && segments[last].begin == segments[last - 1].end) ++last;
    log_likelihood += Chain(features, segments, models, first, last, slack).align(accept);
    first = last;
  }
  return log_likelihood;
}

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFloorShare = 0.01;           // of each feature's variance over all recordings
constexpr double kNoise_rad = 0.2 * kDegree;   // lower bound of a sensor's noise
constexpr double kStill_rad = 1e-4 * kDegree;  // a channel with a smaller deviation is constant
constexpr double kOwnModelFrom = 3;  // examples; with fewer, a context uses its label's model

// One segment: its frames within a recording, and its context. At the ends of a closed recording it
// is in a second one, too, where the recording's other end is its neighbour; else `also` is -1.
struct Example {
  std::size_t recording, segment;
  int context, also;
};

struct ByIndices {
  bool operator()(const Context& a, const Context& b) const {
    return std::tie(a.previous, a.current, a.next) < std::tie(b.previous, b.current, b.next);
  }
};

void write(const StateModel& model, NumberWriter& numbers) {
  numbers.add(model.mean).add(model.variance).add(model.stay);
}

StateModel model_from(NumberReader& numbers) {
  StateModel model;
  model.mean = numbers.matrix();
  model.variance = numbers.matrix();
  model.stay = numbers.vector();
  return model;
}

void write(const Statistics& sums, NumberWriter& numbers) {
  numbers.add(sums.occupancy).add(sums.first).add(sums.second).add(sums.stays);
  numbers.add(sums.duration_first).add(sums.duration_second);
  numbers.add(sums.examples).add(sums.log_likelihood);
}

Statistics statistics_from(NumberReader& numbers) {
  Statistics sums;
  sums.occupancy = numbers.vector();
  sums.first = numbers.matrix();
  sums.second = numbers.matrix();
  sums.stays = numbers.vector();
  sums.duration_first = numbers.vector();
  sums.duration_second = numbers.vector();
  sums.examples = numbers.number();
  sums.log_likelihood = numbers.number();
  return sums;
}

class Trainer {
 public:
  Trainer(const std::vector<Recording>& recordings, const std::vector<Label>& labels,
          const ContextOptions& options)
      : recordings_(recordings), options_(options), label_models_(labels.size()) {
    for (const Recording& recording : recordings) {
      features_.push_back(features_of(recording.angles_rad));
    }
    list_examples(labels);
    set_floor();
  }

  [[nodiscard]] bool anything_moves() const {
    return std::ranges::any_of(out_.moves, [](bool moves) { return moves; });
  }

  bool train_isolated() {
    const auto labels = label_models_.size();
    const auto of_labels = run(labels, 0.0, 0.5, [this](std::size_t l) { return label_task(l); });
    if (!of_labels) return false;
    for (std::size_t l = 0; l < labels; ++l) {
      NumberReader numbers((*of_labels)[l]);
      if (!numbers.at_end()) label_models_[l] = model_from(numbers);
    }
    const auto contexts = out_.contexts.size();
    const auto of_contexts =
        run(contexts, 0.5, 1.0, [this](std::size_t c) { return context_task(c); });
    if (!of_contexts) return false;
    out_.log_likelihood = 0.0;
    for (std::size_t c = 0; c < contexts; ++c) {
      NumberReader numbers((*of_contexts)[c]);
      out_.sums[c] = statistics_from(numbers);
      out_.log_likelihood += out_.sums[c].log_likelihood;
      if (!numbers.at_end()) context_models_[c] = model_from(numbers);
    }
    return true;
  }

  bool train_embedded() {
    for (int round = 0; round < options_.embedded_rounds; ++round) {
      const auto parts = run(recordings_.size(), 1.0, 1.0,
                             [this](std::size_t recording) { return embedded_task(recording); });
      if (!parts) return false;
      embedded_round(*parts);
    }
    return true;
  }

  ContextModels finish() { return std::move(out_); }

 private:
  // Runs tasks whose progress goes from one fraction of the whole to another.
  std::optional<std::vector<TaskResult>> run(std::size_t count, double from, double to,
                                             const Task& task) const {
    return options_.tasks->run(count, task, [&](std::size_t done) {
      const double share = static_cast<double>(done) / static_cast<double>(count);
      return !options_.progress || options_.progress(from + (to - from) * share);
    });
  }

  void list_examples(const std::vector<Label>& labels) {
    const auto index_of = [&](const Segment& segment) {
      const auto found = std::ranges::find(labels, segment.label, &Label::name);
      return static_cast<int>(found - labels.begin());
    };
    std::map<Context, int, ByIndices> known;
    struct Found {
      Example example;
      Context context, also;
    };
    std::vector<Found> found;
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      const auto& segments = recordings_[r].segments;
      const std::size_t last = segments.size() - 1;
      for (std::size_t s = 0; s <= last; ++s) {
        Context context{index_of(segments[s > 0 ? s - 1 : s]), index_of(segments[s]),
                        index_of(segments[s < last ? s + 1 : s])};
        Context also = context;
        if (recordings_[r].closed && s == 0) also.previous = index_of(segments[last]);
        if (recordings_[r].closed && s == last) also.next = index_of(segments[0]);
        // A gesture that is repeated at once stands after itself in earnest: the missing neighbour
        // must not count as another repetition.
        const auto repeats = [&](std::size_t other) {
          return other != s && segments[other].label == segments[s].label;
        };
        if (repeats(std::min(s + 1, last)) || repeats(s > 0 ? s - 1 : s)) context = also;
        known[context] = 0;
        known[also] = 0;
        found.push_back({{r, s, 0, 0}, context, also});
      }
    }
    for (auto& [context, index] : known) {
      index = static_cast<int>(out_.contexts.size());
      out_.contexts.push_back(context);
    }
    for (auto& [example, context, also] : found) {
      example.context = known[context];
      example.also = known[also] != example.context ? known[also] : -1;
      examples_.push_back(example);
    }
    out_.sums.resize(out_.contexts.size());
    context_models_.resize(out_.contexts.size());
  }

  // Variance floors: a share of each feature's total variance, and what sensor noise adds to the
  // value, its delta (1/2 of the noise variance) and its delta-delta (6 times).
  void set_floor() {
    const Index dims = features_.front().cols();
    VectorXd first = VectorXd::Zero(dims);
    VectorXd second = VectorXd::Zero(dims);
    double frames = 0.0;
    const Eigen::RowVectorXd origin =
        features_.front().row(0);  // near the data, which avoids cancellation
    for (const FeatureMatrix& features : features_) {
      const FeatureMatrix off = features.rowwise() - origin;
      first += off.colwise().sum();
      second += off.cwiseAbs2().colwise().sum();
      frames += static_cast<double>(features.rows());
    }
    const VectorXd variance = second / frames - (first / frames).cwiseAbs2();
    const Index channels = dims / kDeltaWindows;
    const double noise = kNoise_rad * kNoise_rad;
    VectorXd least(dims);
    least << VectorXd::Constant(channels, noise), VectorXd::Constant(channels, 0.5 * noise),
        VectorXd::Constant(channels, 6.0 * noise);
    out_.floor = (kFloorShare * variance).cwiseMax(least);
    for (Index c = 0; c < channels; ++c) {
      out_.moves.push_back(variance[c] > kStill_rad * kStill_rad);
    }
  }

  [[nodiscard]] Frames frames_of(const Example& example) const {
    const Segment& segment = recordings_[example.recording].segments[example.segment];
    return features_[example.recording].middleRows(segment.begin, segment.frames());
  }

  template <typename Wanted>
  [[nodiscard]] std::vector<Frames> frames_where(const Wanted& wanted) const {
    std::vector<Frames> frames;
    for (const Example& example : examples_) {
      const bool is_wanted = wanted(example.context) || (example.also >= 0 && wanted(example.also));
      if (is_wanted) frames.emplace_back(frames_of(example));
    }
    return frames;
  }

  [[nodiscard]] Fit fit_of(const std::vector<Frames>& frames, StateModel start, int rounds) const {
    return baum_welch(frames, std::move(start), rounds, out_.floor,
                      [this] { return options_.tasks->stopping(); });
  }

  // The model of a label; nothing where it was not recorded.
  [[nodiscard]] TaskResult label_task(std::size_t label) const {
    const auto frames = frames_where(
        [&](int context) { return out_.contexts[context].current == static_cast<int>(label); });
    if (frames.empty()) return {};
    StateModel model = estimate(flat_start(frames, kStates), out_.floor, {});
    for (int round = 0; round < options_.segmental_rounds && !options_.tasks->stopping(); ++round) {
      model = estimate(align_hard(frames, model), out_.floor, model);
    }
    const Fit fit = fit_of(frames, std::move(model), options_.rounds);
    NumberWriter numbers;
    write(estimate(fit.sums, out_.floor, fit.model), numbers);
    return numbers.take();
  }

  // The statistics of a context and, where it has enough examples, its own model.
  [[nodiscard]] TaskResult context_task(std::size_t c) const {
    const auto frames = frames_where([&](int context) { return context == static_cast<int>(c); });
    const StateModel& start = label_models_[out_.contexts[c].current];
    const bool few = static_cast<double>(frames.size()) < kOwnModelFrom;
    const Fit fit = fit_of(frames, start, few ? 0 : options_.rounds);
    NumberWriter numbers;
    write(fit.sums, numbers);
    if (!few) write(estimate(fit.sums, out_.floor, fit.model), numbers);
    return numbers.take();
  }

  [[nodiscard]] const StateModel& model_of(int context) const {
    const StateModel& own = context_models_[context];
    return own.stay.size() > 0 ? own : label_models_[out_.contexts[context].current];
  }

  // Where each segment of a recording lies: the log likelihood, then the arguments of PartFunction.
  [[nodiscard]] TaskResult embedded_task(std::size_t r) const {
    const Recording& recording = recordings_[r];
    std::vector<const StateModel*> models;
    for (const Example& example : examples_) {
      if (example.recording == r) models.push_back(&model_of(example.context));
    }
    const int slack = static_cast<int>(std::lround(options_.embedded_slack_s * recording.rate_hz));
    NumberWriter parts;
    const double log_likelihood = align_embedded(
        features_[r], recording.segments, models, slack,
        [&](std::size_t segment, Index first, const MatrixXd& gamma, const VectorXd& stays) {
          parts.add(static_cast<double>(segment)).add(static_cast<double>(first));
          parts.add(gamma).add(stays);
        });
    return parts.add(log_likelihood).take();
  }

  // Adds up in the order of recordings and segments, whoever aligned them.
  void embedded_round(const std::vector<TaskResult>& parts) {
    const Index dims = out_.floor.size();
    std::vector<Statistics> contexts(out_.contexts.size(), Statistics(kStates, dims));
    std::vector<Statistics> labels(label_models_.size(), Statistics(kStates, dims));
    out_.log_likelihood = 0.0;
    auto first = examples_.cbegin();
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      NumberReader numbers(parts[r]);
      for (std::size_t s = 0; s < recordings_[r].segments.size(); ++s) {
        const Index segment = numbers.index();
        const Index from = numbers.index();
        const MatrixXd gamma = numbers.matrix();
        const VectorXd stays = numbers.vector();
        const Frames frames = features_[r].middleRows(from, gamma.rows());
        const int context = first[segment].context;
        contexts[context].add(frames, gamma, stays);
        const int also = first[segment].also;
        if (also >= 0) contexts[also].add(frames, gamma, stays);
        labels[out_.contexts[context].current].add(frames, gamma, stays);
      }
      out_.log_likelihood += numbers.number();
      first += std::ssize(recordings_[r].segments);
    }
    for (std::size_t l = 0; l < labels.size(); ++l) {
      if (labels[l].examples > 0.0) {
        label_models_[l] = estimate(labels[l], out_.floor, label_models_[l]);
      }
    }
    for (std::size_t c = 0; c < contexts.size(); ++c) {
      if (contexts[c].examples >= kOwnModelFrom) {
        context_models_[c] = estimate(contexts[c], out_.floor, model_of(static_cast<int>(c)));
      }
    }
    out_.sums = std::move(contexts);
  }

  const std::vector<Recording>& recordings_;
  const ContextOptions& options_;
  std::vector<FeatureMatrix> features_;     // [recording]
  std::vector<Example> examples_;           // in the order of recordings and segments
  std::vector<StateModel> label_models_;    // [label]; empty where it was not recorded
  std::vector<StateModel> context_models_;  // [context]; empty where its label's model is used
  ContextModels out_;
};

}  // namespace

Result<ContextModels> train_contexts(const std::vector<Recording>& recordings,
                                     const std::vector<Label>& labels,
                                     const ContextOptions& options) {
  Trainer trainer(recordings, labels, options);
  if (!trainer.anything_moves()) {
    return fail("no angle changes in the recording; is the glove's data in it?",
                recordings.front().file);
  }
  if (!trainer.train_isolated() || !trainer.train_embedded()) {
    return training_stopped();
  }
  return trainer.finish();
}

}  // namespace posed::gesture
