// What became of a log that was replayed and compared, as one JSON object. Cold.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/replay/expectation.hpp"

namespace posed::tools {

struct ReplayOutcome {
  std::uint64_t frames = 0, raw_frames = 0;
  replay::Expectation::Counts counts{};
  std::string isa{};      // on which it was replayed
  std::string problem{};  // empty: all as published
  std::vector<std::string> missing{};
  double took_s = 0.0;
};

// The same keys for one log as for several.
[[nodiscard]] nlohmann::ordered_json json_of(const std::string& log,
                                             const std::string& recorded_isa,
                                             const ReplayOutcome& outcome);

}  // namespace posed::tools
