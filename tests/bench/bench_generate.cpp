// posed_bench generate: the cost of trajectories beside SPTK and LAPACK, and whether fingers go
// through each other in any label sequence.
#include <cmath>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/progress.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/gesture/train.hpp"
#include "models/perform/constrain.hpp"
#include "proto/text/json_text.hpp"
#include "tests/bench/bench_trajectory.hpp"

namespace posed::bench {
namespace {

using nlohmann::json;

constexpr const char* kBenchGenerateFooter =
    R"(Three measurements in one run, with a
model of a synthetic signer unless --model names one:
  streaming   66 channels frame by frame, cost and error by delay, beside SPTK's mlpg over the whole
              file at the same delay (its -s S has delay S + 1)
  batch       366 frames of 45 channels at once, beside 45 calls of LAPACK's dpbsv
  strings     every string of four labels of g c p 1 3 4: the smallest gap between fingers, in cm
A baseline that is not installed is named and left out (Debian: sptk, liblapack3).

  posed_bench generate
  posed_bench generate --strings 50 --json)";

struct BenchGenerateOptions {
  std::string model;
  int samples = 500;
  int strings = -1;
  bool json = false;
};

Result<gesture::GestureModel> synthetic_model() {
  const auto performance = TRY(gesture::make_performance({}));
  constexpr double kRate_hz = 30.0;
  auto recording = TRY(gesture::recording_of(performance.clip, kRate_hz));
  TRY(gesture::cut(recording, performance.labels, "synthetic labels"));
  return gesture::train_gesture({recording}, {});
}

// Every sequence of four of the labels g c p 1 3 4, or `count` of them, evenly spaced.
Result<json> bench_strings(const trajectory::StateInformation& information, int count) {
  const auto alphabet = TRY(perform::labels_of(information.model(), "g c p 1 3 4"));
  constexpr int kLength = 4;
  const auto letters = static_cast<int>(alphabet.size());
  const int all = static_cast<int>(std::pow(letters, kLength));
  const int asked = count < 0 ? all : std::min(count, all);
  tools::ProgressBar bar;
  double smallest_m = INFINITY;
  double before_m = INFINITY;
  double changed_rad = 0.0;
  long frames = 0;
  int overlapping = 0;
  for (int i = 0; i < asked; ++i) {
    if (!bar.show("strings", static_cast<double>(i) / asked)) return fail("stopped");
    std::vector<int> labels;
    for (int code = static_cast<int>(static_cast<long>(i) * all / asked), l = 0; l < kLength; ++l) {
      labels.push_back(alphabet[static_cast<std::size_t>(code % letters)]);
      code /= letters;
    }
    auto performance = TRY(perform::perform(information, labels, {}));
    const auto kept = perform::constrain(performance, default_hand_shape());
    smallest_m = std::min(smallest_m, kept.min_gap_m);
    before_m = std::min(before_m, kept.before_m);
    changed_rad = std::max(changed_rad, kept.changed_rad);
    overlapping += kept.before_m < 0.0 ? 1 : 0;
    frames += static_cast<long>(performance.angles.size());
  }
  return json{{"strings", asked},
              {"frames", frames},
              {"min_gap_cm", 100.0 * smallest_m},
              {"min_gap_before_cm", 100.0 * before_m},
              {"overlapping_before", overlapping},
              {"largest_change_rad", changed_rad},
              {"seconds", bar.elapsed_s()}};
}

Result<json> bench(const BenchGenerateOptions& options) {
  auto model = TRY(options.model.empty() ? synthetic_model() : gesture::load_model(options.model));
  const double rate_hz = model.rate_hz;
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(std::move(model)), rate_hz);
  json report{{"streaming", bench_streaming(information)},
              {"batch", bench_batch(information, options.samples)}};
  if (options.strings != 0) {
    auto strings = TRY(bench_strings(information, options.strings));
    report["strings"] = strings;
  }
  return report;
}

void print_missing(const json& part) {
  if (part.contains("missing")) std::printf("  left out: %s\n", json_text(part["missing"]).c_str());
}

void print_streaming(const json& part) {
  std::printf("streaming, %d channels, %d frames\n", part["channels"].get<int>(),
              part["frames"].get<int>());
  std::printf("  %5s %10s %8s %8s %8s %8s %10s %12s %8s\n", "delay", "error deg", "mean us", "p50",
              "p99", "p99.9", "SPTK us", "its error", "faster");
  for (const json& row : part["delays"]) {
    std::printf("  %5d %10.4f %8.2f %8.2f %8.2f %8.2f", row["delay"].get<int>(),
                row["error_deg"].get<double>(), row["mean_us"].get<double>(),
                row["p50_us"].get<double>(), row["p99_us"].get<double>(),
                row["p99_9_us"].get<double>());
    if (row.contains("sptk_us")) {
      std::printf(" %10.1f %12.4f %7.0fx", row["sptk_us"].get<double>(),
                  row["sptk_error_deg"].get<double>(), row["times_faster"].get<double>());
    }
    std::printf("\n");
  }
  print_missing(part);
}

void print_batch(const json& part) {
  std::printf("batch, %d frames of %d channels: p50 %.0f us, p99 %.0f us",
              part["frames"].get<int>(), part["channels"].get<int>(),
              part["ours"]["p50_us"].get<double>(), part["ours"]["p99_us"].get<double>());
  if (part.contains("dpbsv")) {
    std::printf("; dpbsv p50 %.0f us, %.1f times ours, %.1e deg apart",
                part["dpbsv"]["p50_us"].get<double>(), part["times_faster"].get<double>(),
                part["max_difference_deg"].get<double>());
  }
  if (part.contains("sptk_us")) std::printf("; SPTK %.0f us", part["sptk_us"].get<double>());
  std::printf("\n");
  print_missing(part);
}

void print_strings(const json& part) {
  std::printf(
      "%d strings, %ld frames in %.1f s: smallest gap %.3f cm (%.3f before the constraints, "
      "%d strings overlapped)\n",
      part["strings"].get<int>(), part["frames"].get<long>(), part["seconds"].get<double>(),
      part["min_gap_cm"].get<double>(), part["min_gap_before_cm"].get<double>(),
      part["overlapping_before"].get<int>());
}

}  // namespace

void add_bench_generate(CLI::App& bench_app, int& exit_code) {
  const auto options = std::make_shared<BenchGenerateOptions>();
  CLI::App* command = bench_app.add_subcommand("generate", "Trajectories from gesture models");
  command->footer(kBenchGenerateFooter);
  command->add_option("--model", options->model, "A gesture model instead of the synthetic one");
  command->add_option("--samples", options->samples, "Timed batch solves")
      ->check(CLI::Range(3, 1'000'000))
      ->capture_default_str();
  command->add_option("--strings", options->strings, "How many strings (0: none; default: all)");
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] {
    const auto made = bench(*options);
    if (!made) {
      exit_code = tools::report(made.error());
      return;
    }
    if (options->json) {
      std::printf("%s\n", made->dump(2).c_str());
    } else {
      print_streaming((*made)["streaming"]);
      print_batch((*made)["batch"]);
      if (made->contains("strings")) print_strings((*made)["strings"]);
    }
    const bool apart = !made->contains("strings") || (*made)["strings"]["min_gap_cm"] >= 0.0;
    exit_code = static_cast<int>(apart ? ExitCode::kDone : ExitCode::kFailed);
  });
}

}  // namespace posed::bench
