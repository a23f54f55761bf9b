// `posed_bench predict`: the cost of one call of the style filter's Gaussian process, compared with
// just reading the same bytes.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <hwy/aligned_allocator.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/options.hpp"
#include "models/gp/isa.hpp"
#include "models/gp/predictor.hpp"
#include "models/gp/regression.hpp"
#include "models/gp/synthetic.hpp"
#include "proto/text/json_text.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"
#include "tests/bench/stream_sum.hpp"

namespace posed::bench {
namespace {

using nlohmann::json;
using Floats = hwy::AlignedFreeUniquePtr<float[]>;

// one hot sample is the mean of this many calls, so that reading the clock costs only 1 %
constexpr int kHotCalls = 8;
constexpr const char* kBenchPredictFooter =
    R"(Synthetic walkers; queries from one who is not in the training set.
hot: everything in L2 before the clock starts. cold: L2 emptied before each call, as between two
frames of a 120 Hz stream. The reference sums as many floats as the process logically reads
(N x 2D), with eight vector accumulators. four_at_rest, four_moving and four_settling are four
styles in one model, with weights that rest, that move at every call and that have just come to
rest. Variants take turns, so that they run under the same conditions.

  posed_bench predict
  posed_bench predict --samples 500 --json)";

// One variant to time: a call for query i. It returns a float, so that no call is optimised away.
struct Variant {
  std::string name;
  std::function<float(int)> call;
  std::vector<double> hot_us{}, cold_us{};
};

// Prevents the optimiser from removing the computation of this value.
void keep(float value) { asm volatile("" : : "x"(value) : "memory"); }

// Reads memory to push everything else out of the L2 cache.
class Evictor {
 public:
  Evictor() {
    const long l2_bytes = ::sysconf(_SC_LEVEL2_CACHE_SIZE);
    const long bytes = std::max(4 * std::max(l2_bytes, 0L), 8L << 20);
    count_ = static_cast<int>(bytes / 4 / 128 * 128);
    data_ = hwy::AllocateAligned<float>(static_cast<std::size_t>(count_));
    std::fill_n(data_.get(), count_, 1.0F);
  }
  void run() const { keep(stream_sum(data_.get(), count_)); }

 private:
  int count_ = 0;
  Floats data_;
};

double time_us(const Variant& variant, int query, int calls) {
  using Steady = std::chrono::steady_clock;
  const auto start = Steady::now();
  for (int i = 0; i < calls; ++i) keep(variant.call(query + i));
  return std::chrono::duration<double, std::micro>(Steady::now() - start).count() / calls;
}

void measure(std::vector<Variant>& variants, int samples, const Evictor& evictor) {
  for (int i = 0; i < samples; ++i) {
    for (Variant& variant : variants) {
      for (int warm = 0; warm < 2; ++warm) time_us(variant, i, 1);
      variant.hot_us.push_back(time_us(variant, i, kHotCalls));
    }
  }
  for (int i = 0; i < samples; ++i) {
    for (Variant& variant : variants) {
      evictor.run();
      variant.cold_us.push_back(time_us(variant, i, 1));
    }
  }
}

Floats ones(int count) {
  Floats data = hwy::AllocateAligned<float>(static_cast<std::size_t>(count));
  std::fill_n(data.get(), count, 1.0F);
  return data;
}

int to_yardstick(int floats) { return (floats + 127) / 128 * 128; }

constexpr std::array kVariants{"sum", "mean", "four_at_rest", "four_moving", "four_settling"};

constexpr int kStyles = 4;  // of the mixture

// A Gaussian process, the ways to call it, and the queries as the hot path has them.
struct Subject {
  gp::SyntheticProcess made;
  gp::Predictor plain;
  mutable gp::Predictor resting, moving;  // kStyles functions on the same poses
  Eigen::MatrixXf queries;                // [dims x queries]
  mutable std::vector<float> out;

  [[nodiscard]] std::span<const float> query(int i) const {
    const auto column = queries.col(i % queries.cols());
    return {column.data(), static_cast<std::size_t>(column.size())};
  }
  float mean(int i) const {
    plain.mean(query(i), {}, out);
    return out[0];
  }
  // The mixture has been put together.
  float rest(int i) const {
    static_cast<void>(resting.settle(shares(0)));
    resting.mean(query(i), {}, out);
    return out[0];
  }
  // Other shares at every call.
  float move(int i) const {
    moving.mean(query(i), {}, out, shares(i));
    return out[0];
  }
  // The same, and the mixture is begun anew for them.
  float settle(int i) const {
    static_cast<void>(moving.settle(shares(i)));
    return move(i);
  }
  static std::array<float, kStyles> shares(int i) {
    const float first = 0.25F + 0.2F * static_cast<float>(i % 97) / 97.0F;
    return {first, 0.5F - first, 0.3F, 0.2F};
  }
};

Subject subject(int poses, int dims) {
  gp::SyntheticProcess made = gp::synthetic(poses, dims);
  auto plain = gp::Predictor::build(made.process).value();
  std::vector<gp::Function> more;
  for (int s = 1; s < kStyles; ++s) {
    more.push_back({made.process.weights / s, made.process.offset / s});
  }
  auto resting = gp::Predictor::build(made.process, more).value();
  auto moving = gp::Predictor::build(made.process, more).value();
  for (int i = 0; i < gp::Predictor::kSettleCalls; ++i) {
    static_cast<void>(resting.settle(Subject::shares(0)));
  }
  Eigen::MatrixXf queries = made.queries.transpose().cast<float>();
  return {std::move(made),    std::move(plain),
          std::move(resting), std::move(moving),
          std::move(queries), std::vector<float>(static_cast<std::size_t>(dims))};
}

// The largest errors against a reference in double precision, and whether all instruction sets give
// the same bits.
json accuracy(const Subject& subject) {
  const auto& made = subject.made;
  const Eigen::MatrixXd exact = gp::posterior_mean(made.process, made.queries);
  const std::string isa_before(gp::isa_name());
  std::vector<std::vector<float>> all;
  json report;
  for (const auto* isa : {"avx2", "avx512"}) {
    if (!gp::set_isa(isa)) continue;
    double mean_rad = 0.0;
    auto& bits = all.emplace_back();
    for (int i = 0; i < made.queries.rows(); ++i) {
      static_cast<void>(subject.mean(i));
      for (int o = 0; o < subject.plain.outputs(); ++o) {
        mean_rad = std::max(mean_rad, std::abs(subject.out[o] - exact(i, o)));
      }
      bits.insert(bits.end(), subject.out.begin(), subject.out.end());
    }
    report["max_mean_error_deg"] = mean_rad * tools::kDegrees;
  }
  report["avx2_avx512_same_bits"] = all.size() == 2 ? json(all[0] == all[1]) : json(nullptr);
  if (const auto back = gp::set_isa(isa_before); !back) report["error"] = back.error().message;
  return report;
}

json run_case(int poses, int dims, int samples, const Evictor& evictor) {
  const Subject s = subject(poses, dims);
  const int read = to_yardstick(poses * 2 * dims);
  const Floats data = ones(read);
  std::vector<Variant> variants{{"sum", [&](int) { return stream_sum(data.get(), read); }},
                                {"mean", [&](int i) { return s.mean(i); }},
                                {"four_at_rest", [&](int i) { return s.rest(i); }},
                                {"four_moving", [&](int i) { return s.move(i); }},
                                {"four_settling", [&](int i) { return s.settle(i); }}};
  measure(variants, samples, evictor);
  json report{{"poses", poses}, {"dims", dims}, {"accuracy", accuracy(s)}};
  for (const Variant& variant : variants) {
    json& entry = report[variant.name];
    entry = {{"hot", percentiles(variant.hot_us)}, {"cold", percentiles(variant.cold_us)}};
    for (const auto* heat : {"hot", "cold"}) {
      const double p50 = entry[heat]["p50_us"];
      entry[heat]["ratio"] = p50 / report["sum"][heat]["p50_us"].get<double>();
    }
  }
  for (const auto* mixture : {"four_at_rest", "four_moving", "four_settling"}) {
    for (const auto* heat : {"hot", "cold"}) {
      json& entry = report[mixture][heat];
      entry["times_one_style"] =
          entry["p50_us"].get<double>() / report["mean"][heat]["p50_us"].get<double>();
    }
  }
  return report;
}

void print_case(const json& report) {
  std::printf("\nN = %d, D = %d\n", report["poses"].get<int>(), report["dims"].get<int>());
  std::printf("  %-13s %-5s %8s %8s %8s %8s %7s\n", "", "", "p50 us", "p99", "p99.9", "max",
              "x sum");
  for (const auto* name : kVariants) {
    for (const auto* heat : {"hot", "cold"}) {
      const json& row = report[name][heat];
      std::printf("  %-13s %-5s %8.2f %8.2f %8.2f %8.2f %7.2f", name, heat,
                  row["p50_us"].get<double>(), row["p99_us"].get<double>(),
                  row["p99_9_us"].get<double>(), row["max_us"].get<double>(),
                  row["ratio"].get<double>());
      if (row.contains("times_one_style")) {
        std::printf("   %.2f times mean", row["times_one_style"].get<double>());
      }
      std::printf("\n");
    }
  }
  const json& accuracy = report["accuracy"];
  std::printf("  mean within %.1e degree of double\n",
              accuracy["max_mean_error_deg"].get<double>());
  const json& same = accuracy["avx2_avx512_same_bits"];
  std::printf("  AVX2 and AVX-512 bits: %s\n",
              same.is_null() ? "not compared, this CPU lacks one" : (same ? "the same" : "DIFFER"));
}

struct PredictBench {
  int samples = 2000;
  bool json = false;
};

// Returns whether the instruction sets agree.
bool bench_predict(const PredictBench& bench) {
  const Evictor evictor;
  json cases = json::array();
  if (!bench.json) std::printf("instruction set: %s\n", std::string(gp::isa_name()).c_str());
  bool same = true;
  for (const int dims : {43, 63}) {
    for (const int poses : {200, 1000}) {
      cases.push_back(run_case(poses, dims, bench.samples, evictor));
      same = same && cases.back()["accuracy"]["avx2_avx512_same_bits"] != json(false);
      if (!bench.json) print_case(cases.back());
    }
  }
  const json figures{{"isa", gp::isa_name()},
                     {"hot_calls_per_sample", kHotCalls},
                     {"samples", bench.samples},
                     {"cases", cases}};
  if (bench.json) std::printf("%s\n", json_text(figures, 2).c_str());
  return same;
}

}  // namespace

void add_bench_predict(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<PredictBench>();
  CLI::App* command = bench.add_subcommand("predict", "One call of the style filter's process");
  command->footer(kBenchPredictFooter);
  command->add_option("--samples", options->samples, "Timed samples for each variant")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] {
    exit_code = static_cast<int>(bench_predict(*options) ? ExitCode::kDone : ExitCode::kFailed);
  });
}

}  // namespace posed::bench
