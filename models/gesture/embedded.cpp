#include "models/gesture/embedded.hpp"

#include <algorithm>

#include "models/gesture/gesture_model.hpp"

namespace posed::gesture {
namespace {

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

  double align(const TakePart& take) const {
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
      take(first_ + s, begin_ + from, gamma, posterior.stays.segment(s * kStates, kStates));
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

}  // namespace

double align_embedded(const FeatureMatrix& features, const std::vector<Segment>& segments,
                      const std::vector<const StateModel*>& models, int slack,
                      const TakePart& take) {
  double log_likelihood = 0.0;
  for (std::size_t first = 0; first < segments.size();) {
    std::size_t last = first + 1;
    while (last < segments.size() && segments[last].begin == segments[last - 1].end) ++last;
    log_likelihood += Chain(features, segments, models, first, last, slack).align(take);
    first = last;
  }
  return log_likelihood;
}

}  // namespace posed::gesture
