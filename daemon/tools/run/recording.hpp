// Streaming with a device log: what `posed record`, and `posed run` with a [record] table, do.
// Cold.
#pragma once

#include <filesystem>
#include <string>

#include <spdlog/spdlog.h>

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/frame/result.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {

// What `record` and `replay` report of a source without a stream in the log. It may have named
// bodies that nobody wanted or that were refused.
[[nodiscard]] inline std::string no_body_of(const std::string& source) {
  return "source " + in_quotes(source) + " named no body that became a stream";
}

inline void warn_of_no_body(const std::string& source) { spdlog::warn("{}", no_body_of(source)); }

struct RecordingPlan {
  std::string out;               // the log; empty: one in `folder`
  std::filesystem::path folder;  // made if it is not there; the log is named after the present time
  bool frames = false;           // keep the published frames, too
  bool clips = false;      // write each take of each stream as a BVH beside the log when it ends
  bool overwrite = false;  // replace the log `out` if it is there already
  bool json = false;       // at the end, print what was written as JSON
  ServeOptions serve;
};

// Call prepare_to_serve() first. Returns when the daemon has ended and the log is complete.
Result<> stream_and_record(const RecordingPlan& plan, const config::DaemonConfig& config);

}  // namespace posed::tools
