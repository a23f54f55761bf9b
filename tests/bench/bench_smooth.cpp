// posed_bench smooth: the cost of the live smoother and its error, beside baselines that are tuned
// on the very motion on which they are evaluated.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/options.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/smooth/adaptive_window.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/json_text.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/bench/percentiles.hpp"
#include "tests/bench/smooth_inputs.hpp"

namespace posed::bench {
namespace {

using clip::ChannelMatrix;
using nlohmann::json;

constexpr const char* kBenchSmoothFooter =
    R"(Without --clip the truth is a synthetic signer of 20 gestures at 60 Hz. White noise is
added, and every baseline is tuned on the very data it is judged by; errors are rms in degrees over
the channels that move. "Where not" is where simple filters are strongest: a glove's own dead band,
and slow steady ramps under noise. Costs are ratios to one bare solve of the same window in the same
run.

  posed_bench smooth
  posed_bench smooth --clip glove1.csv glove2.csv     # recordings taken as the truth
  posed_bench smooth --inputs FOLDER --half judge     # many motions and noises of devices, lag 1
  posed_bench smooth --cost                           # only what a frame costs)";

struct BenchSmoothOptions {
  std::vector<std::string> clips;
  std::string inputs, half = "judge";
  unsigned seed = 11;
  bool cost = false, json = false;
};

struct Truth {
  ChannelMatrix angles;  // [frames x 45] deg
  double rate_hz = 60.0;
};

Result<std::vector<Truth>> truths_of(const BenchSmoothOptions& options) {
  std::vector<Truth> truths;
  const auto add = [&truths](clip::HandClip hand) {
    clip::fill_gaps(hand);
    ChannelMatrix angles(static_cast<Eigen::Index>(hand.angles.size()), kHandChannels);
    for (std::size_t t = 0; t < hand.angles.size(); ++t) {
      for (std::size_t c = 0; c < kHandChannels; ++c) {
        angles(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(c)) =
            hand.angles[t][c] * tools::kDegrees;
      }
    }
    truths.push_back({std::move(angles), hand.rate_hz});
  };
  for (const std::string& path : options.clips) {
    auto hand = TRY(clip::read_hand_clip(path));
    if (hand.angles.size() < 100) return fail("has fewer than 100 frames; take a longer one", path);
    add(std::move(hand));
  }
  if (!truths.empty()) return truths;
  auto made = TRY(gesture::make_performance(
      {.gestures = 20, .rate_hz = 60.0, .noise_deg = 0.0, .dead_band_deg = 0.0}));
  add(std::move(made.clip));
  return truths;
}

// Adds noise to the channels that move; the other channels are not part of a trial.
Trial trial_of(const Truth& truth, double noise_deg, unsigned seed) {
  std::vector<Eigen::Index> moving;
  for (Eigen::Index c = 0; c < truth.angles.cols(); ++c) {
    if (truth.angles.col(c).maxCoeff() > truth.angles.col(c).minCoeff()) moving.push_back(c);
  }
  Trial trial;
  trial.rate_hz = truth.rate_hz;
  trial.truth = truth.angles(Eigen::all, moving);
  trial.measured = trial.truth;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (double& value : trial.measured.reshaped()) value += noise_deg * noise(random);
  return trial;
}

// The live smoother's solve on any number of channels; row t is the estimate of frame t.
ChannelMatrix live(const Trial& trial, int lag, double noise_deg) {
  const auto channels = static_cast<int>(trial.measured.cols());
  smooth::AdaptiveWindow window(channels);
  ChannelMatrix made = trial.measured;
  std::vector<double> row(static_cast<std::size_t>(channels));
  for (Eigen::Index t = 0; t < made.rows(); ++t) {
    for (int c = 0; c < channels; ++c) {
      row[static_cast<std::size_t>(c)] = trial.measured(t, c) / tools::kDegrees;
    }
    window.push(static_cast<double>(t) / trial.rate_hz, row,
                {.noise_rad = noise_deg / tools::kDegrees});
    window.solve(1.0 / trial.rate_hz);
    if (t < lag) continue;
    made.row(t - lag) =
        Eigen::Map<const Eigen::RowVectorXd>(window.x(lag), channels) * tools::kDegrees;
  }
  return made;
}

double pooled(const std::vector<Trial>& trials, int lag, double noise_deg) {
  double square = 0.0;
  for (const Trial& trial : trials) {
    square += std::pow(bench::rms_deg(live(trial, lag, noise_deg), trial.truth), 2);
  }
  return std::sqrt(square / static_cast<double>(trials.size()));
}

// One table row per filter, one column per lag.
json table(const std::vector<Trial>& trials, double noise_deg) {
  json rows = json::object();
  for (const int lag : {0, 1, 3}) {
    rows["live stage"].push_back(pooled(trials, lag, noise_deg));
    for (const auto& baseline : bench::tuned_baselines(trials, lag, noise_deg)) {
      rows[baseline.name].push_back(baseline.rms_deg);
    }
  }
  return rows;
}

// A glove that only reports changes larger than its dead band.
Trial stairs_of(const Truth& truth, double band_deg) {
  Trial trial = trial_of(truth, 0.0, 0);
  for (Eigen::Index c = 0; c < trial.truth.cols(); ++c) {
    double shown = trial.truth(0, c);
    for (double& value : trial.measured.col(c)) {
      if (std::abs(value - shown) > band_deg) shown = value;
      value = shown;
    }
  }
  return trial;
}

// Ramps up and down between 0 and 60 degrees at a constant speed.
Truth ramps_of(double deg_s) {
  Truth truth;
  truth.angles.resize(1800, 4);
  for (Eigen::Index t = 0; t < truth.angles.rows(); ++t) {
    const double way = std::fmod(deg_s * static_cast<double>(t) / truth.rate_hz, 120.0);
    truth.angles.row(t).setConstant(way < 60.0 ? way : 120.0 - way);
  }
  return truth;
}

json accuracy(const std::vector<Truth>& truths, unsigned seed) {
  json report;
  for (const double noise_deg : {1.0, 3.0}) {
    std::vector<Trial> trials;
    for (const Truth& truth : truths) trials.push_back(trial_of(truth, noise_deg, seed));
    const std::string name = "noise " + std::to_string(static_cast<int>(noise_deg)) + " deg";
    report["tables"][name] = table(trials, noise_deg);
    for (int lag = 0; lag <= smooth::kMaxLagFrames; ++lag) {
      report["lag_curve_deg"][name].push_back(pooled(trials, lag, noise_deg));
    }
  }
  std::vector<Trial> stairs;
  for (const Truth& truth : truths) stairs.push_back(stairs_of(truth, 4.0));
  report["where_not"]["dead band of 4 deg"] = table(stairs, 1.0);
  for (const double deg_s : {10.0, 60.0}) {
    report["where_not"]["ramps of " + std::to_string(static_cast<int>(deg_s)) +
                        " deg/s, noise 3 deg"] = table({trial_of(ramps_of(deg_s), 3.0, seed)}, 3.0);
  }
  return report;
}

// 45 channels, window of 26 frames: one bare solve, the whole solve and the whole stage, timed in
// turns.
json cost(unsigned seed) {
  constexpr int kFrames = 4000;
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  smooth::AdaptiveWindow window(kHandChannels);
  smooth::LiveSmoother stage(skeleton, {.lag = {}, .noise_rad = 1.0 / tools::kDegrees});
  struct Last final : StageOut {
    void frame(const StageFrame& made) noexcept override {
      const Frame& frame = made.frame;
      angle = frame.angle_rad[0];
    }
    float angle = 0.0F;
  } last;
  std::vector<double> bare_us, solve_us, stage_us;
  const auto timed = [](std::vector<double>& us, const auto& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
                     .count());
  };
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0 / tools::kDegrees);
  for (int t = 0; t < kFrames; ++t) {
    const double now_s = t / 60.0;
    HandAngles angles{};
    for (std::size_t c = 0; c < angles.size(); ++c) {
      angles[c] = 0.5 * std::sin(2.0 * now_s + static_cast<double>(c)) + noise(random);
    }
    Frame frame;
    set_hand_angles(skeleton, angles, frame);
    frame.header.device_ns = nanoseconds(now_s);
    window.push(now_s, angles, {.noise_rad = 1.0 / tools::kDegrees});
    timed(bare_us, [&] { window.solve_once(1.0 / 60.0); });
    timed(solve_us, [&] { window.solve(1.0 / 60.0); });
    timed(stage_us, [&] { stage.process({.frame = frame}, last); });
  }
  json report{{"bare_solve", percentiles(bare_us)},
              {"live_solve", percentiles(solve_us)},
              {"stage", percentiles(stage_us)}};
  for (const char* name : {"live_solve", "stage"}) {
    report[name]["p50_over_bare"] =
        report[name]["p50_us"].get<double>() / report["bare_solve"]["p50_us"].get<double>();
  }
  return report;
}

void print_table(const std::string& title, const json& rows) {
  std::printf("\n%s: rms error [deg] at lag 0, 1, 3 frames\n", title.c_str());
  for (const auto& [name, values] : rows.items()) {
    std::printf("  %-28s %7.3f %7.3f %7.3f\n", name.c_str(), values[0].get<double>(),
                values[1].get<double>(), values[2].get<double>());
  }
}

void print(const json& report) {
  std::printf(
      "a frame of 45 channels, window 26      p50 us      p99    p99.9      max   x bare\n");
  for (const char* name : {"bare_solve", "live_solve", "stage"}) {
    const json& row = report["cost"][name];
    std::printf("  %-33s %9.1f %8.1f %8.1f %8.1f %8.2f\n", name, row["p50_us"].get<double>(),
                row["p99_us"].get<double>(), row["p99_9_us"].get<double>(),
                row["max_us"].get<double>(), row.value("p50_over_bare", 1.0));
  }
  if (!report.contains("accuracy")) return;
  const json& accuracy = report["accuracy"];
  for (const auto& [title, rows] : accuracy["tables"].items()) print_table(title, rows);
  std::printf("\nerror against lag, 0 to 5 frames [deg]\n");
  for (const auto& [name, values] : accuracy["lag_curve_deg"].items()) {
    std::printf("  %-14s", name.c_str());
    for (const json& value : values) std::printf(" %7.3f", value.get<double>());
    std::printf("\n");
  }
  std::printf("\nwhere not:\n");
  for (const auto& [title, rows] : accuracy["where_not"].items()) print_table(title, rows);
}

// The stage with the noise that it learns itself, over the better of the two rivals at lag 1.
json many_inputs(const BenchSmoothOptions& options) {
  constexpr int kLag = 1;
  json report = json::object();
  for (const SmoothInput& input :
       smooth_inputs(options.inputs, options.half == "tune" ? Half::kTune : Half::kJudge)) {
    double square = 0.0;
    for (const Trial& trial : input.trials) {
      square += std::pow(bench::rms_deg(live_stage(trial, kLag), trial.truth), 2);
    }
    const double live_deg = std::sqrt(square / static_cast<double>(input.trials.size()));
    double rival_deg = std::numeric_limits<double>::infinity();
    for (const auto& rival : bench::tuned_baselines(input.trials, kLag, input.noise_deg)) {
      const bool counts = rival.name.starts_with("One-Euro") || rival.name.starts_with("Kalman");
      if (counts) rival_deg = std::min(rival_deg, rival.rms_deg);
    }
    report[input.motion][input.noise] = {
        {"live_deg", live_deg}, {"rival_deg", rival_deg}, {"ratio", live_deg / rival_deg}};
  }
  return report;
}

void print_inputs(const json& report) {
  std::printf("rms error [deg] at lag 1: live stage, best tuned One-Euro or Kalman, ratio\n");
  for (const auto& [motion, noises] : report.items()) {
    for (const auto& [noise, row] : noises.items()) {
      std::printf("  %-20s %-12s %7.3f %7.3f %6.3f\n", motion.c_str(), noise.c_str(),
                  row["live_deg"].get<double>(), row["rival_deg"].get<double>(),
                  row["ratio"].get<double>());
    }
  }
}

Result<> bench_smooth(const BenchSmoothOptions& options) {
  if (!options.inputs.empty()) {
    const json made = many_inputs(options);
    if (options.json) {
      std::printf("%s\n", json_text(made, 2).c_str());
    } else {
      print_inputs(made);
    }
    return {};
  }
  json report{{"cost", cost(options.seed)}};
  if (!options.cost) {
    const auto truths = TRY(truths_of(options));
    report["accuracy"] = accuracy(truths, options.seed);
  }
  if (options.json) {
    std::printf("%s\n", json_text(report, 2).c_str());
  } else {
    print(report);
  }
  return {};
}

}  // namespace

void add_bench_smooth(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<BenchSmoothOptions>();
  CLI::App* command = bench.add_subcommand("smooth", "The live stage: its cost and its baselines");
  command->footer(kBenchSmoothFooter);
  command->add_option("--clip", options->clips, "Hand CSVs taken as the truth")
      ->type_name("REC.csv");
  command->add_option("--inputs", options->inputs, "Folder of public glove recordings")
      ->type_name("FOLDER");
  command->add_option("--half", options->half, "Of the inputs: those to tune on, or to judge by")
      ->check(CLI::IsMember({"tune", "judge"}))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Of the noise")->capture_default_str();
  command->add_flag("--cost", options->cost, "Only the cost of a frame");
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] { exit_code = tools::report(bench_smooth(*options)); });
}

}  // namespace posed::bench
