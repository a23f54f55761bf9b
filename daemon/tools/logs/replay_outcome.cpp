#include "daemon/tools/logs/replay_outcome.hpp"

namespace posed::tools {

nlohmann::ordered_json json_of(const std::string& log, const std::string& recorded_isa,
                               const ReplayOutcome& outcome) {
  nlohmann::ordered_json line{{"log", log},
                              {"same", outcome.problem.empty()},
                              {"frames", outcome.frames},
                              {"raw_frames", outcome.raw_frames},
                              {"compared", outcome.counts.compared},
                              {"lost", outcome.counts.lost},
                              {"after_gap", outcome.counts.after_gap},
                              {"past_end", outcome.counts.past_end},
                              {"isa", outcome.isa},
                              {"recorded_isa", recorded_isa},
                              {"missing", outcome.missing},
                              {"took_s", outcome.took_s}};
  if (!outcome.problem.empty()) line["problem"] = outcome.problem;
  return line;
}

}  // namespace posed::tools
