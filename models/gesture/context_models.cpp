#include "models/gesture/context_models.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "models/gesture/embedded.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kFloorShare = 0.01;           // of each feature's variance over all recordings
constexpr double kNoise_rad = 0.2 * kDegree;   // lower bound of a sensor's noise
constexpr double kStill_rad = 1e-4 * kDegree;  // a channel with a smaller deviation is constant
constexpr double kOwnModelFrom = 3;  // examples; with fewer, a context uses its label's model

// One segment: its context, and its frames within a recording.
struct Example {
  std::size_t recording, segment;
  int context;
};

struct ByIndices {
  bool operator()(const Context& a, const Context& b) const {
    return std::tie(a.previous, a.current, a.next) < std::tie(b.previous, b.current, b.next);
  }
};

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
    for (std::size_t label = 0; label < label_models_.size(); ++label) {
      if (!report_progress(0.5 * static_cast<double>(label) /
                           static_cast<double>(label_models_.size()))) {
        return false;
      }
      train_label(static_cast<int>(label));
    }
    out_.log_likelihood = 0.0;
    for (std::size_t c = 0; c < out_.contexts.size(); ++c) {
      if (!report_progress(0.5 + 0.5 * static_cast<double>(c) /
                                     static_cast<double>(out_.contexts.size()))) {
        return false;
      }
      train_context(c);
    }
    return true;
  }

  bool train_embedded() {
    for (int round = 0; round < options_.embedded_rounds; ++round) {
      if (!report_progress(1.0)) return false;
      embedded_round();
    }
    return true;
  }

  ContextModels finish() { return std::move(out_); }

 private:
  bool report_progress(double fraction) const {
    return !options_.progress || options_.progress(fraction);
  }

  void list_examples(const std::vector<Label>& labels) {
    const auto index_of = [&](const Segment& segment) {
      const auto found = std::ranges::find(labels, segment.label, &Label::name);
      return static_cast<int>(found - labels.begin());
    };
    std::map<Context, int, ByIndices> known;
    std::vector<std::pair<Example, Context>> found;
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      const auto& segments = recordings_[r].segments;
      for (std::size_t s = 0; s < segments.size(); ++s) {
        const Context context{index_of(segments[s > 0 ? s - 1 : s]), index_of(segments[s]),
                              index_of(segments[s + 1 < segments.size() ? s + 1 : s])};
        known[context] = 0;
        found.push_back({{r, s, 0}, context});
      }
    }
    for (auto& [context, index] : known) {
      index = static_cast<int>(out_.contexts.size());
      out_.contexts.push_back(context);
    }
    for (auto& [example, context] : found) {
      example.context = known[context];
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
      if (wanted(example.context)) frames.emplace_back(frames_of(example));
    }
    return frames;
  }

  void train_label(int label) {
    const auto frames =
        frames_where([&](int context) { return out_.contexts[context].current == label; });
    if (frames.empty()) return;
    StateModel model = estimate(flat_start(frames, kStates), out_.floor, {});
    for (int round = 0; round < options_.segmental_rounds; ++round) {
      model = estimate(align_hard(frames, model), out_.floor, model);
    }
    const Fit fit = baum_welch(frames, std::move(model), options_.rounds, out_.floor);
    label_models_[label] = estimate(fit.sums, out_.floor, fit.model);
  }

  void train_context(std::size_t c) {
    const auto frames = frames_where([&](int context) { return context == static_cast<int>(c); });
    const StateModel& start = label_models_[out_.contexts[c].current];
    const bool few = static_cast<double>(frames.size()) < kOwnModelFrom;
    Fit fit = baum_welch(frames, start, few ? 0 : options_.rounds, out_.floor);
    out_.log_likelihood += fit.sums.log_likelihood;
    out_.sums[c] = std::move(fit.sums);
    if (!few) context_models_[c] = estimate(out_.sums[c], out_.floor, fit.model);
  }

  [[nodiscard]] const StateModel& model_of(int context) const {
    const StateModel& own = context_models_[context];
    return own.stay.size() > 0 ? own : label_models_[out_.contexts[context].current];
  }

  void embedded_round() {
    const Index dims = out_.floor.size();
    std::vector<Statistics> contexts(out_.contexts.size(), Statistics(kStates, dims));
    std::vector<Statistics> labels(label_models_.size(), Statistics(kStates, dims));
    out_.log_likelihood = 0.0;
    auto example = examples_.cbegin();
    for (std::size_t r = 0; r < recordings_.size(); ++r) {
      const Recording& recording = recordings_[r];
      const auto first = example;
      std::vector<const StateModel*> models;
      for (; example != examples_.cend() && example->recording == r; ++example) {
        models.push_back(&model_of(example->context));
      }
      const int slack =
          static_cast<int>(std::lround(options_.embedded_slack_s * recording.rate_hz));
      out_.log_likelihood +=
          align_embedded(features_[r], recording.segments, models, slack,
                         [&](std::size_t segment, const Frames& frames,
                             const Eigen::MatrixXd& gamma, const VectorXd& stays) {
                           const int context = first[static_cast<std::ptrdiff_t>(segment)].context;
                           contexts[context].add(frames, gamma, stays);
                           labels[out_.contexts[context].current].add(frames, gamma, stays);
                         });
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
    return fail("the training was stopped; nothing was written");
  }
  return trainer.finish();
}

}  // namespace posed::gesture
