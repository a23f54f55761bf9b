#include "daemon/tools/bench/hop_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "proto/frame/time.hpp"

namespace posed::tools {
namespace {

using Ages = std::vector<double>;  // us

double quantile(const Ages& sorted, double p) {
  if (sorted.empty()) return 0.0;
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::lround(p * last))];
}

double median(Ages values) {
  std::ranges::sort(values);
  return quantile(values, 0.5);
}

}  // namespace

HopFigures figures_of(Ages ages_us) {
  std::ranges::sort(ages_us);
  return {quantile(ages_us, 0.5), quantile(ages_us, 0.99), quantile(ages_us, 0.999),
          ages_us.empty() ? 0.0 : ages_us.back(), ages_us.size()};
}

std::vector<double> send_ages_us(std::span<const Arrival> arrivals) {
  std::vector<double> ages_us;
  for (const Arrival& arrival : arrivals) {
    ages_us.push_back(static_cast<double>(arrival.sent_ns) * 1e-3);
  }
  return ages_us;
}

HopReport report_hops(std::span<const Arrival> arrivals, std::int64_t start_ns,
                      std::int64_t end_ns) {
  std::map<std::int64_t, std::array<Ages, 2>> pairs;  // pipeline, bare
  std::array<Ages, 2> all;
  for (const Arrival& arrival : arrivals) {
    const std::int64_t pair = (arrival.arrival_ns - start_ns) / (2 * kNanosPerSecond);
    if (pair < 1 || arrival.arrival_ns >= end_ns) continue;
    const double age_us = static_cast<double>(arrival.age_ns) * 1e-3;
    pairs[pair][arrival.bare ? 1 : 0].push_back(age_us);
    all[arrival.bare ? 1 : 0].push_back(age_us);
  }
  Ages p50_ratios;
  Ages p99_ratios;
  for (const auto& [pair, ages] : pairs) {
    if (ages[0].empty() || ages[1].empty()) continue;
    const HopFigures pipeline = figures_of(ages[0]);
    const HopFigures bare = figures_of(ages[1]);
    p50_ratios.push_back(pipeline.p50_us / bare.p50_us);
    p99_ratios.push_back(pipeline.p99_us / bare.p99_us);
  }
  return {figures_of(all[1]), figures_of(all[0]), median(p50_ratios), median(p99_ratios)};
}

}  // namespace posed::tools
