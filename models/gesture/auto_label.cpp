#include "models/gesture/auto_label.hpp"

#include <algorithm>
#include <cmath>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/train.hpp"
#include "proto/frame/median.hpp"

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSmooth_s = 0.07;      // half width of the moving average against sensor noise
constexpr double kMinDuration_s = 0.3;  // no gesture is shorter
constexpr double kSearch_s =
    0.5;  // a move's fastest moment is at most this far from the change of pose
constexpr double kRestShare = 0.1;  // of the peak's energy above rest: here the move starts
constexpr double kForbidden = 1e9;  // cost of another label inside an example

FeatureMatrix smoothed(const FeatureMatrix& angles, int half) {
  FeatureMatrix out(angles.rows(), angles.cols());
  for (Index t = 0; t < angles.rows(); ++t) {
    const Index from = std::max<Index>(t - half, 0);
    const Index to = std::min<Index>(t + half + 1, angles.rows());
    out.row(t) = angles.middleRows(from, to - from).colwise().mean();
  }
  return out;
}

class Proposer {
 public:
  explicit Proposer(const Recording& recording)
      : recording_(recording),
        poses_(label_poses({recording})),
        angles_(smoothed(recording.angles_rad, frames(kSmooth_s))) {
    const Index count = angles_.rows();
    energy_ = VectorXd::Zero(count);
    for (Index t = 1; t + 1 < count; ++t) {
      energy_[t] = 0.5 * (angles_.row(t + 1) - angles_.row(t - 1)).norm();
    }
    VectorXd sorted = energy_;
    rest_ = median(sorted);
  }

  [[nodiscard]] bool poses_differ() const {
    return std::ranges::any_of(poses_, [&](const LabelPose& pose) {
      return pose.angles_rad != poses_.front().angles_rad;
    });
  }

  std::vector<Segment> propose() {
    std::vector<Segment> segments = segments_of(best_labels());
    const int shift = learnt_shift(segments);
    for (std::size_t i = 1; i < segments.size(); ++i) {
      const int earliest = segments[i - 1].begin + 1;
      const int begin = std::clamp(onset(segments[i].begin) + shift, earliest, segments[i].end - 1);
      segments[i].begin = segments[i - 1].end = begin;
    }
    return with_examples(segments);
  }

 private:
  [[nodiscard]] int frames(double seconds) const {
    return static_cast<int>(std::lround(seconds * recording_.rate_hz));
  }

  // Squared distance of every frame to every label's pose, in units in which two poses are 2 apart;
  // inside an example only its own label is possible.
  [[nodiscard]] MatrixXd costs() const {
    const auto labels = static_cast<Index>(poses_.size());
    MatrixXd pose(labels, angles_.cols());
    for (Index k = 0; k < labels; ++k) {
      pose.row(k) =
          Eigen::Map<const Eigen::RowVectorXd>(poses_[k].angles_rad.data(), angles_.cols());
    }
    double apart = 0.0;
    for (Index k = 0; k < labels; ++k) {
      apart += (pose.rowwise() - pose.row(k)).rowwise().squaredNorm().sum();
    }
    const double unit = apart / static_cast<double>(4 * labels * (labels - 1));
    MatrixXd cost(angles_.rows(), labels);
    for (Index k = 0; k < labels; ++k) {
      cost.col(k) = (angles_.rowwise() - pose.row(k)).rowwise().squaredNorm() / unit;
    }
    for (const Segment& example : recording_.segments) {
      const int middle =
          example.begin + example.frames() / 2;  // the first half may still show the previous pose
      for (Index k = 0; k < labels; ++k) {
        if (poses_[k].name == example.label) continue;
        cost.col(k).segment(middle, example.end - middle).setConstant(kForbidden);
      }
    }
    return cost;
  }

  // The cheapest labelling of all frames, where each change of label has a cost.
  [[nodiscard]] std::vector<int> best_labels() const {
    const MatrixXd cost = costs();
    const Index labels = cost.cols();
    const double price = 4.0 * frames(kMinDuration_s) / 2.0;
    Eigen::MatrixXi from(cost.rows(), labels);
    VectorXd best = cost.row(0);
    for (Index t = 1; t < cost.rows(); ++t) {
      Index cheapest = 0;
      const double change = best.minCoeff(&cheapest) + price;
      for (Index k = 0; k < labels; ++k) {
        const bool stays = best[k] <= change;
        from(t, k) = static_cast<int>(stays ? k : cheapest);
        best[k] = (stays ? best[k] : change) + cost(t, k);
      }
    }
    std::vector<int> labelled(static_cast<std::size_t>(cost.rows()));
    Index last = 0;
    best.minCoeff(&last);
    for (Index t = cost.rows() - 1; t > 0; --t) {
      labelled[t] = static_cast<int>(last);
      last = from(t, last);
    }
    labelled[0] = static_cast<int>(last);
    return labelled;
  }

  [[nodiscard]] std::vector<Segment> segments_of(const std::vector<int>& labelled) const {
    std::vector<Segment> segments;
    for (int t = 0; t < static_cast<int>(labelled.size()); ++t) {
      if (t == 0 || labelled[t] != labelled[t - 1]) {
        segments.push_back({t, t, poses_[labelled[t]].name});
      }
      segments.back().end = t + 1;
    }
    return segments;
  }

  // The frame at which the move starts that changes the pose at `change`.
  [[nodiscard]] int onset(int change) const {
    const auto count = static_cast<int>(energy_.size());
    const int from = std::max(change - frames(kSearch_s), 0);
    const int to = std::min(change + frames(kSearch_s), count);
    Index peak = 0;
    const double most = energy_.segment(from, to - from).maxCoeff(&peak);
    int t = from + static_cast<int>(peak);
    while (t > 0 && energy_[t - 1] > rest_ + kRestShare * (most - rest_)) --t;
    return t;
  }

  // The median distance of the examples' borders from the onset of the move.
  [[nodiscard]] int learnt_shift(const std::vector<Segment>& segments) const {
    std::vector<int> shifts;
    for (const Segment& example : recording_.segments) {
      for (std::size_t i = 1; i < segments.size(); ++i) {
        const bool same = segments[i].label == example.label && segments[i].begin < example.end &&
                          segments[i].end > example.begin;
        if (same) shifts.push_back(example.begin - onset(segments[i].begin));
      }
    }
    if (shifts.empty()) return 0;
    return median(shifts);
  }

  // The examples unchanged, with the proposals around them. Where the rest of a proposal beside an
  // example is too short for a gesture, it is added to its other neighbour.
  [[nodiscard]] std::vector<Segment> with_examples(const std::vector<Segment>& proposed) const {
    std::vector<Segment> left;
    for (Segment rest : proposed) {
      for (const Segment& example : recording_.segments) {
        if (example.end <= rest.begin || example.begin >= rest.end) continue;
        if (example.begin - rest.begin >= frames(kMinDuration_s)) {
          left.push_back({rest.begin, example.begin, rest.label});
        }
        rest.begin = std::min(example.end, rest.end);
      }
      if (rest.frames() >= std::max(frames(kMinDuration_s), kStates)) left.push_back(rest);
    }
    left.insert(left.end(), recording_.segments.begin(), recording_.segments.end());
    return joined(std::move(left));
  }

  // In time order; gaps shorter than a gesture are closed by stretching the proposals beside them.
  [[nodiscard]] std::vector<Segment> joined(std::vector<Segment> segments) const {
    std::ranges::sort(segments, {}, &Segment::begin);
    const auto is_example = [&](const Segment& s) {
      return std::ranges::any_of(recording_.segments, [&](const Segment& e) {
        return e.begin == s.begin && e.end == s.end;
      });
    };
    for (std::size_t i = 1; i < segments.size(); ++i) {
      Segment& before = segments[i - 1];
      Segment& after = segments[i];
      if (before.end >= after.begin) continue;
      if (!is_example(before)) {
        before.end = after.begin;
      } else if (!is_example(after)) {
        after.begin = before.end;
      }
    }
    return segments;
  }

  const Recording& recording_;
  std::vector<LabelPose> poses_;
  FeatureMatrix angles_;
  VectorXd energy_;  // [frame] how fast the whole hand moves, rad a frame
  double rest_ = 0.0;
};

}  // namespace

Result<std::vector<Segment>> propose_segments(const Recording& recording) {
  Proposer proposer(recording);
  if (!proposer.poses_differ()) {
    return fail("label at least one example each of two different poses; two of each are better",
                recording.file);
  }
  return proposer.propose();
}

}  // namespace posed::gesture
