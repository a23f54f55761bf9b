// Replays several logs at once, each on one core, and compares each with its own frames: what CI
// does with all the logs that it keeps. Cold.
#pragma once

#include <string>
#include <vector>

namespace posed::tools {

struct FarmOptions {
  std::vector<std::string> logs;
  std::string isa;  // empty: each log's own
  bool json = false;
};

// Prints one line for each log on stdout, in their order, and one sentence for all on stderr.
// Returns the exit code: 1 if a log differs or cannot be replayed, or after Ctrl-C, which ends it
// within a second.
[[nodiscard]] int replay_farm(const FarmOptions& options);

}  // namespace posed::tools
