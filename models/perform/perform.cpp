#include "models/perform/perform.hpp"

#include <algorithm>
#include <set>
#include <sstream>

#include "models/perform/global_variance.hpp"
#include "models/perform/label_sequence.hpp"
#include "models/trajectory/fixed_lag.hpp"
#include "models/trajectory/sliding_window.hpp"

namespace posed::perform {
namespace {

std::vector<PerformedState> plan(const trajectory::StateInformation& information,
                                 std::span<const int> labels, double tempo) {
  LabelSequence script(static_cast<int>(labels.size()));
  for (const int label : labels) static_cast<void>(script.append(label));
  std::vector<PerformedState> states;
  int start = 0;
  for (Cursor cursor = enter(script, information, script.first(), tempo); cursor.frames_left > 0;
       step(cursor, script, information, tempo)) {
    if (cursor.frames_left == cursor.frames) {
      PerformedState& entered = states.emplace_back(
          PerformedState{script.context(cursor.position), cursor.state, start, cursor.frames, {}});
      for (int f = 0; f < kFingers; ++f) {
        entered.leaf[f] =
            gesture::leaf_index(information.model(), cursor.state, f, entered.context);
      }
    }
    ++start;
  }
  return states;
}

HandAngles angles_of(const double* row) {
  HandAngles angles;
  std::copy_n(row, kHandChannels, angles.begin());
  return angles;
}

void solve_all(const std::vector<const double*>& frames, Performance& performance) {
  const auto count = static_cast<int>(frames.size());
  trajectory::SlidingWindow window(kHandChannels, count);
  window.solve(frames);
  constexpr int kStride = trajectory::padded(kHandChannels);
  const auto variances = hwy::AllocateAligned<double>(frames.size() * kStride);
  window.variances(variances.get());
  for (int t = 0; t < count; ++t) {
    performance.angles.push_back(angles_of(window.x(t)));
    performance.variances.push_back(
        angles_of(variances.get() + static_cast<std::ptrdiff_t>(t) * kStride));
  }
}

void solve_with_lag(const std::vector<const double*>& frames, int lag, Performance& performance) {
  trajectory::FixedLag stream(kHandChannels, lag);
  trajectory::InformationForm out(kHandChannels, 1);
  double* x = out.row(0, trajectory::kPosition);
  double* variance = out.row(0, trajectory::kPositionMean);
  const auto give = [&](int back) {
    stream.estimate(back, x, variance);
    performance.angles.push_back(angles_of(x));
    performance.variances.push_back(angles_of(variance));
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

Result<std::vector<int>> labels_of(const gesture::GestureModel& model, std::string_view text) {
  std::vector<int> labels;
  std::set<std::string> unknown;
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    labels.push_back(model.label_index(word));
    if (labels.back() < 0) unknown.insert(word);
  }
  const auto listed = [](const auto& items, const auto& name_of) {
    std::string all;
    for (const auto& item : items) all += (all.empty() ? "" : " ") + name_of(item);
    return all;
  };
  if (!unknown.empty()) {
    return misuse("unknown label(s) " + listed(unknown, [](const std::string& s) { return s; }) +
                  "; the model knows " +
                  listed(model.labels, [](const gesture::Label& l) { return l.name; }));
  }
  if (labels.empty()) return misuse("name at least one label, as in \"g c p\"");
  return labels;
}

Performance perform(const trajectory::StateInformation& information, std::span<const int> labels,
                    const PerformOptions& options) {
  Performance performance{information.rate_hz(), plan(information, labels, options.tempo), {}, {}};
  trajectory::InformationForm rows(kHandChannels, static_cast<int>(performance.states.size()));
  std::vector<const double*> frames;
  for (std::size_t i = 0; i < performance.states.size(); ++i) {
    const PerformedState& state = performance.states[i];
    information.fill(state.context, state.state,
                     rows.row(static_cast<int>(i), trajectory::kPosition));
    frames.insert(frames.end(), static_cast<std::size_t>(state.frames),
                  rows.frame(static_cast<int>(i)));
  }
  if (options.look_ahead) {
    solve_with_lag(frames, *options.look_ahead, performance);
  } else {
    solve_all(frames, performance);
  }
  if (options.global_variance) restore_variance(information.model(), performance);
  return performance;
}

}  // namespace posed::perform
