#include "tests/bench/bench_trajectory.hpp"
#include "daemon/tools/command/options.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/perform/perform.hpp"
#include "models/trajectory/fixed_lag.hpp"
#include "models/trajectory/sliding_window.hpp"
#include "tests/bench/lapack_baseline.hpp"
#include "tests/bench/sptk.hpp"

namespace posed::bench {
namespace {

using nlohmann::json;
using trajectory::InformationForm;
using trajectory::Row;
using Steady = std::chrono::steady_clock;

constexpr int kRepeats = 3;  // of everything except SPTK; the median counts

double since_us(Steady::time_point start) {
  return std::chrono::duration<double, std::micro>(Steady::now() - start).count();
}

double quantile(std::vector<double>& values, double p) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
}

json quantiles(std::vector<double> us) {
  return {{"p50_us", quantile(us, 0.5)},
          {"p99_us", quantile(us, 0.99)},
          {"p99_9_us", quantile(us, 0.999)},
          {"max_us", quantile(us, 1.0)}};
}

// A new folder in the system's temporary folder.
struct Scratch {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("posed-bench-" + std::to_string(::getpid()));
  Scratch() { std::filesystem::create_directories(path); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

// The first `frames` frames of a random label sequence; channels beyond those of the hand repeat
// it.
InformationForm script_evidence(const trajectory::StateInformation& model, int frames,
                                int channels) {
  std::mt19937 random(1);
  InformationForm all(channels, frames);
  InformationForm hand(kHandChannels, 1);
  std::vector<int> labels;
  for (int i = 0; i < frames / 20; ++i) {
    labels.push_back(static_cast<int>(random() % model.model().labels.size()));
  }
  const auto performance = perform::perform(model, labels, {}).value();
  for (const auto& state : performance.states) {
    model.fill(state.context, state.state, hand.row(0, Row::kPosition));
    for (int t = state.start; t < std::min(frames, state.start + state.frames); ++t) {
      for (int r = 0; r < trajectory::kRows; ++r) {
        const double* from = hand.row(0, static_cast<Row>(r));
        double* to = all.row(t, static_cast<Row>(r));
        for (int c = 0; c < channels; ++c) to[c] = from[c % kHandChannels];
      }
    }
  }
  return all;
}

SptkInput for_sptk(const InformationForm& information) {
  SptkInput input{information.channels(), {}};
  for (int t = 0; t < information.frames(); ++t) {
    for (const bool variance : {false, true}) {
      for (int w = 0; w < trajectory::kRows; w += 2) {
        const double* precision = information.row(t, static_cast<Row>(w));
        const double* mean = information.row(t, static_cast<Row>(w + 1));
        for (int c = 0; c < information.channels(); ++c) {
          input.values.push_back(
              static_cast<float>(variance ? 1.0 / precision[c] : mean[c] / precision[c]));
        }
      }
    }
  }
  return input;
}

std::vector<const double*> frames_of(const InformationForm& information) {
  std::vector<const double*> frames;
  for (int t = 0; t < information.frames(); ++t) frames.push_back(information.frame(t));
  return frames;
}

struct Streamed {
  std::vector<double> us;  // of each frame
  double total_us = 0.0;   // of all frames, with only two clock readings
  double error_deg = 0.0;  // rms against the full solve
};

Streamed stream(const InformationForm& information, const trajectory::SlidingWindow& full,
                int delay) {
  trajectory::FixedLag solver(information.channels(), delay);
  InformationForm out(information.channels(), information.frames());
  Streamed result;
  const auto feed = [&](auto&& each) {
    for (int t = 0; t < information.frames(); ++t) {
      each([&] {
        solver.push(information.frame(t));
        if (t >= delay) solver.estimate(delay, out.row(t - delay, Row::kPosition), nullptr);
      });
    }
  };
  const auto start = Steady::now();
  feed([](auto&& work) { work(); });
  result.total_us = since_us(start);
  double squares = 0.0;
  for (int t = 0; t + delay < information.frames(); ++t) {
    for (int c = 0; c < information.channels(); ++c) {
      squares += std::pow(out.row(t, Row::kPosition)[c] - full.x(t)[c], 2);
    }
  }
  result.error_deg = tools::kDegrees *
                     std::sqrt(squares / (information.frames() - delay) / information.channels());
  solver = trajectory::FixedLag(information.channels(), delay);
  feed([&](auto&& work) {
    const auto begin = Steady::now();
    work();
    result.us.push_back(since_us(begin));
  });
  return result;
}

double sptk_error_deg(const SptkRun& run, const trajectory::SlidingWindow& full, int frames,
                      int channels, int delay) {
  double squares = 0.0;
  for (int t = 0; t + delay < frames; ++t) {
    for (int c = 0; c < channels; ++c) {
      squares +=
          std::pow(run.trajectory[static_cast<std::size_t>(t * channels + c)] - full.x(t)[c], 2);
    }
  }
  return tools::kDegrees * std::sqrt(squares / (frames - delay) / channels);
}

}  // namespace

json bench_streaming(const trajectory::StateInformation& model) {
  constexpr int kFrames = 2040;
  constexpr int kChannels = 66;
  const InformationForm information = script_evidence(model, kFrames, kChannels);
  trajectory::SlidingWindow full(kChannels, kFrames);
  full.solve(frames_of(information));
  const SptkInput input = for_sptk(information);
  const Scratch scratch;
  json rows = json::array();
  std::string missing;
  for (const int delay : {3, 5, 10, 15, 20, 30, 40}) {
    std::vector<double> ours, theirs;
    Streamed streamed;
    json row{{"delay", delay}};
    for (int repeat = 0; repeat < kRepeats; ++repeat) {
      streamed = stream(information, full, delay);
      ours.push_back(streamed.total_us / kFrames);
      if (delay != 5 && delay != 15 && delay != 30) continue;
      const auto run = run_sptk(input, delay - 1, scratch.path);
      if (!run || run->trajectory.size() != std::size_t{kFrames} * kChannels) {
        missing = run ? "SPTK's mlpg gave another number of frames" : run.error().text();
        continue;
      }
      theirs.push_back(1e6 * run->seconds / kFrames);
      row["sptk_error_deg"] = sptk_error_deg(*run, full, kFrames, kChannels, delay);
    }
    row.update(quantiles(streamed.us));
    row["mean_us"] = quantile(ours, 0.5);
    row["error_deg"] = streamed.error_deg;
    if (!theirs.empty()) {
      row["sptk_us"] = quantile(theirs, 0.5);
      row["times_faster"] = quantile(theirs, 0.5) / quantile(ours, 0.5);
    }
    rows.push_back(row);
  }
  json report{{"channels", kChannels}, {"frames", kFrames}, {"delays", rows}};
  if (!missing.empty()) report["missing"] = missing;
  return report;
}

json bench_batch(const trajectory::StateInformation& model, int samples) {
  constexpr int kFrames = 366;
  const InformationForm information = script_evidence(model, kFrames, kHandChannels);
  const auto frames = frames_of(information);
  trajectory::SlidingWindow window(kHandChannels, kFrames);
  auto lapack = LapackBaseline::load();
  std::vector<double> ours, theirs, x;
  for (int i = 0; i < samples; ++i) {
    auto start = Steady::now();
    window.solve(frames);
    ours.push_back(since_us(start));
    if (!lapack) continue;
    start = Steady::now();
    lapack->solve(information, x);
    theirs.push_back(since_us(start));
  }
  json report{{"frames", kFrames}, {"channels", kHandChannels}, {"ours", quantiles(ours)}};
  if (lapack) {
    double worst_rad = 0.0;
    for (int t = 0; t < kFrames; ++t) {
      for (int c = 0; c < kHandChannels; ++c) {
        worst_rad = std::max(
            worst_rad, std::abs(window.x(t)[c] - x[static_cast<std::size_t>(c * kFrames + t)]));
      }
    }
    report["dpbsv"] = quantiles(theirs);
    report["times_faster"] = quantile(theirs, 0.5) / quantile(ours, 0.5);
    report["max_difference_deg"] = worst_rad * tools::kDegrees;
  } else {
    report["missing"].push_back(lapack.error().text());
  }
  const Scratch scratch;
  constexpr int kRange = 30;
  if (const auto sptk = run_sptk(for_sptk(information), kRange, scratch.path)) {
    report["sptk_us"] = 1e6 * sptk->seconds;
  } else {
    report["missing"].push_back(sptk.error().text());
  }
  return report;
}

}  // namespace posed::bench
