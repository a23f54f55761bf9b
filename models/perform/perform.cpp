#include "models/perform/perform.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "models/perform/label_sequence.hpp"
#include "models/perform/shown_pose.hpp"
#include "models/trajectory/fixed_lag.hpp"
#include "models/trajectory/sliding_window.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/list.hpp"

namespace posed::perform {
namespace {

constexpr double kMaxVarianceGain = 1.3;

struct Moments {
  double sum = 0.0, squares = 0.0, count = 0.0;

  void add(double value, double weight) {
    sum += weight * value;
    squares += weight * value * value;
    count += weight;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double variance() const { return squares / count - mean() * mean(); }
};

// The most likely trajectory stays closer to its mean than the gestures it was learnt from. This
// restores the range: it scales each channel about its mean over the sequence, by 1 to
// kMaxVarianceGain, so that its variance over time approaches that of the means of the performed
// states (models/perform/README.md, "Global variance").
void restore_variance(const gesture::GestureModel& model, Performance& performance) {
  constexpr double kStill_rad2 = 1e-8;  // a channel that does not move has no range to restore
  for (std::size_t g = 0; g < model.groups.size(); ++g) {
    const gesture::ChannelGroup& group = model.groups[g];
    for (int c = group.first; c < group.first + group.channels; ++c) {
      Moments states, shown;
      for (const PerformedState& state : performance.states) {
        const auto& leaf = model.trees[state.state][g].leaves[state.leaf[g]];
        states.add(leaf.mean[0][c - group.first], state.frames);
      }
      for (const Pose& pose : performance.angles) shown.add(pose[c], 1.0);
      if (shown.variance() < kStill_rad2 || states.variance() < kStill_rad2) continue;
      const double gain =
          std::clamp(std::sqrt(states.variance() / shown.variance()), 1.0, kMaxVarianceGain);
      const double mean = shown.mean();
      for (Pose& pose : performance.angles) pose[c] = mean + gain * (pose[c] - mean);
    }
  }
}

Result<std::vector<PerformedState>> plan(const trajectory::StateInformation& information,
                                         std::span<const int> labels, double tempo) {
  const auto most = static_cast<int>(kMaxPerformedAngles /
                                     static_cast<std::size_t>(information.model().channels()));
  LabelSequence script(static_cast<int>(labels.size()));
  for (const int label : labels) static_cast<void>(script.append(label));
  std::vector<PerformedState> states;
  int start = 0;
  for (Cursor cursor = enter(script, information, script.first(), tempo); cursor.frames_left > 0;
       step(cursor, script, information, tempo)) {
    if (cursor.frames > most - start) {
      return fail("the " + std::to_string(labels.size()) + " labels last more than " +
                  std::to_string(std::lround(most / information.rate_hz())) +
                  " s, the most that is performed at once; name fewer labels, or a higher tempo");
    }
    PerformedState& entered = states.emplace_back(
        PerformedState{script.context(cursor.position), cursor.state, start, cursor.frames, {}});
    for (int g = 0; g < std::ssize(information.model().groups); ++g) {
      entered.leaf.push_back(
          gesture::leaf_index(information.model(), cursor.state, g, entered.context));
    }
    start += cursor.frames;
    cursor.frames_left = 1;  // so that the next step is into the next state
  }
  return states;
}

// The mean pose of the longer one of the states in which a label is held; `first` is its state 0.
Pose held_pose(const Performance& performance, const PerformedState* first) {
  const PerformedState& state = first[2].frames < first[3].frames ? first[3] : first[2];
  Pose mean(performance.angles.front().size());
  for (int t = state.start; t < state.start + state.frames; ++t) {
    const Pose& pose = performance.angles[static_cast<std::size_t>(t)];
    for (std::size_t c = 0; c < mean.size(); ++c) mean[c] += pose[c] / state.frames;
  }
  return mean;
}

void hold_as_shown(const trajectory::StateInformation& information, double tempo,
                   Performance& performance) {
  ShownPose shown(information.model().channels());
  shown.restart(true);
  long position = -1;
  Pose held;  // as performed: the variance that was restored moves it from the state's mean
  for (const PerformedState& state : performance.states) {
    if (state.state == 0) {
      ++position;
      held = held_pose(performance, &state);
    }
    for (int t = state.start; t < state.start + state.frames; ++t) {
      shown.advance(information, position, state.context, tempo, held.data());
      Pose& pose = performance.angles[static_cast<std::size_t>(t)];
      for (int c = 0; c < static_cast<int>(pose.size()); ++c) pose[c] += shown.offset_rad(c);
    }
  }
}

void solve_all(const std::vector<const double*>& frames, int channels, Performance& performance) {
  const auto count = static_cast<int>(frames.size());
  trajectory::SlidingWindow window(channels, count);
  window.solve(frames);
  const auto variances = trajectory::make_rows(count, window.stride());
  window.variances(variances.get());
  for (int t = 0; t < count; ++t) {
    const double* const variance =
        variances.get() + static_cast<std::ptrdiff_t>(t) * window.stride();
    performance.angles.emplace_back(window.x(t), window.x(t) + channels);
    performance.variances.emplace_back(variance, variance + channels);
  }
}

void solve_with_lag(const std::vector<const double*>& frames, int channels, int lag,
                    Performance& performance) {
  trajectory::FixedLag stream(channels, lag);
  trajectory::InformationForm out(channels, 1);
  double* x = out.row(0, trajectory::kPosition);
  double* variance = out.row(0, trajectory::kPositionMean);
  const auto give = [&](int back) {
    stream.estimate(back, x, variance);
    performance.angles.emplace_back(x, x + channels);
    performance.variances.emplace_back(variance, variance + channels);
  };
  for (const double* frame : frames) {
    stream.push(frame);
    if (stream.pushed() > lag) give(lag);
  }
  for (long back = std::min<long>(lag, stream.pushed()) - 1; back >= 0; --back) {
    give(static_cast<int>(back));
  }
}

}  // namespace

HandAngles hand_of(const Pose& pose) {
  HandAngles angles;
  std::copy_n(pose.begin(), angles.size(), angles.begin());
  return angles;
}

Result<std::vector<int>> labels_of(const gesture::GestureModel& model, std::string_view text) {
  std::vector<int> labels;
  std::set<std::string> unknown;
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    labels.push_back(model.label_index(word));
    if (labels.back() < 0) unknown.insert(word);
  }
  if (!unknown.empty()) {
    return misuse("unknown label(s) " + joined(unknown, " ") + "; the model knows " +
                  joined(model.labels, " ", &gesture::Label::name));
  }
  if (labels.empty()) return misuse("name at least one label, as in \"g c p\"");
  return labels;
}

Result<Performance> perform(const trajectory::StateInformation& information,
                            std::span<const int> labels, const PerformOptions& options) {
  assert(!labels.empty());
  auto states = TRY(plan(information, labels, options.tempo));
  Performance performance{information.rate_hz(), std::move(states), {}, {}};
  const int channels = information.model().channels();
  trajectory::InformationForm rows(channels, static_cast<int>(performance.states.size()));
  std::vector<const double*> frames;
  for (std::size_t i = 0; i < performance.states.size(); ++i) {
    const PerformedState& state = performance.states[i];
    information.fill(state.context, state.state,
                     rows.row(static_cast<int>(i), trajectory::kPosition));
    frames.insert(frames.end(), static_cast<std::size_t>(state.frames),
                  rows.frame(static_cast<int>(i)));
  }
  if (options.look_ahead) {
    solve_with_lag(frames, channels, *options.look_ahead, performance);
  } else {
    solve_all(frames, channels, performance);
  }
  if (options.global_variance) restore_variance(information.model(), performance);
  hold_as_shown(information, options.tempo, performance);
  const auto plausible = [](double angle_rad) { return std::abs(angle_rad) <= kMaxAngle_rad; };
  for (const Pose& pose : performance.angles) {
    if (!std::ranges::all_of(pose, plausible)) {
      return fail("the model performs angles that nobody has; train it again");
    }
  }
  return performance;
}

gesture::Recording recording_of(const gesture::GestureModel& model,
                                const Performance& performance) {
  gesture::Recording recording{
      .file = "the performance", .rate_hz = performance.rate_hz, .angles_rad = {}, .segments = {}};
  const auto channels = static_cast<Eigen::Index>(performance.angles.front().size());
  recording.angles_rad.resize(static_cast<Eigen::Index>(performance.angles.size()), channels);
  for (Eigen::Index t = 0; t < recording.angles_rad.rows(); ++t) {
    const Pose& pose = performance.angles[t];
    recording.angles_rad.row(t) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), channels);
  }
  for (const PerformedState& state : performance.states) {
    const int end = state.start + state.frames;
    if (state.state == 0) {
      const std::size_t label = state.context.current;
      recording.segments.push_back({state.start, end, model.labels[label].name});
    }
    recording.segments.back().end = end;
  }
  return recording;
}

}  // namespace posed::perform
