// The figures that a benchmark reports of a distribution; never its mean alone.
#pragma once

#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/bench/hop_subscriber.hpp"

namespace posed::bench {

// {"p50_us", "p99_us", "p99_9_us", "max_us"}; needs at least one value.
[[nodiscard]] nlohmann::json percentiles(std::vector<double> values_us);

// How old the poses were when they were handed to ZeroMQ.
[[nodiscard]] std::vector<double> send_ages_us(std::span<const tools::Arrival> arrivals);

}  // namespace posed::bench
