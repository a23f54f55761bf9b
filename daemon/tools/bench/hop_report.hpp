// Evaluates the message ages that the benchmarks' subscribers have recorded.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "daemon/tools/bench/hop_subscriber.hpp"

namespace posed::tools {

struct HopFigures {
  double p50_us = 0.0, p99_us = 0.0, p999_us = 0.0, max_us = 0.0;
  std::uint64_t messages = 0;
};

struct HopReport {
  HopFigures bare, pipeline;
  // Medians over pairs of adjacent one-second blocks, pipeline over bare.
  double block_p50_ratio = 0.0;
  double block_p99_ratio = 0.0;
};

[[nodiscard]] HopFigures figures_of(std::vector<double> ages_us);

// How old the poses were when they were handed to ZeroMQ.
[[nodiscard]] std::vector<double> send_ages_us(std::span<const Arrival> arrivals);

// Block 0 begins at `start_ns`; the pipeline has the even blocks. The first pair (warm-up) and
// everything after `end_ns` are left out.
[[nodiscard]] HopReport report_hops(std::span<const Arrival> arrivals, std::int64_t start_ns,
                                    std::int64_t end_ns);

}  // namespace posed::tools
