#include "tests/bench/percentiles.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace posed::bench {

nlohmann::json percentiles(std::vector<double> values_us) {
  std::ranges::sort(values_us);
  const auto at = [&](double p) {
    return values_us[static_cast<std::size_t>(p * static_cast<double>(values_us.size() - 1))];
  };
  return {{"p50_us", at(0.5)}, {"p99_us", at(0.99)}, {"p99_9_us", at(0.999)}, {"max_us", at(1.0)}};
}

std::vector<double> send_ages_us(std::span<const tools::Arrival> arrivals) {
  std::vector<double> ages_us;
  for (const tools::Arrival& arrival : arrivals) {
    ages_us.push_back(static_cast<double>(arrival.sent_ns) * 1e-3);
  }
  return ages_us;
}

}  // namespace posed::bench
