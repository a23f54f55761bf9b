// Streaming with a device log: what `posed record`, and `posed run` with a [record] table, do.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct RecordingPlan {
  std::string out;         // the log
  bool frames = false;     // keep the published frames, too
  bool clips = false;      // at the end, write each take of each stream as a BVH beside the log
  bool overwrite = false;  // replace the log if it is there already
  bool json = false;       // at the end, print what was written as JSON
  ServeOptions serve;
};

// A path in the folder, named after the present time, that no file has: "<folder>/<utc>.plog", like
// 20261123T013005Z.plog. Makes the folder if it is not there.
[[nodiscard]] Result<std::string> new_log(const std::filesystem::path& folder);

// Call prepare_to_serve() first. Returns when the daemon has ended and the log is complete.
[[nodiscard]] Result<> stream_and_record(const RecordingPlan& plan,
                                         const config::DaemonConfig& config);

}  // namespace posed::tools
