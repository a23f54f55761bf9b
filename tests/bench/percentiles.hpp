// The figures that a benchmark reports of a distribution; never its mean alone.
#pragma once

#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace posed::bench {

// {"p50_us", "p99_us", "p99_9_us", "max_us"}; needs at least one value.
[[nodiscard]] nlohmann::json percentiles(std::vector<double> values_us);

}  // namespace posed::bench
