// Writes a device log of an older format again in the format of today. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "proto/frame/result.hpp"

namespace posed::replay {

struct UpgradeSummary {
  std::uint64_t chunks = 0, decisions = 0, frames = 0;
};

// Replays `log` and writes to `path` the same chunks, decisions, frames and gaps with the numbers
// of items and samples that the older formats lack, so that a replay of either log gives the same
// bits. A log of today's format is an error. `stop` is asked before each chunk; true ends the
// writing with an error. An error leaves no file, and a file that was there stays as it was.
[[nodiscard]] Result<UpgradeSummary> upgrade_log(const std::filesystem::path& log,
                                                 const std::filesystem::path& path,
                                                 const std::function<bool()>& stop);

}  // namespace posed::replay
