// Whether the streams that stages name as partners (StageType::partners) can be that.
#pragma once

#include "daemon/config/daemon_config.hpp"
#include "proto/text/findings.hpp"

namespace posed::config {

// Adds an error for each partner that cannot exist, is the stream itself, or needs the stream as a
// partner, directly or by other streams. Call when all streams and sources are read.
void check_partners(const DaemonConfig& config, Findings& findings);

}  // namespace posed::config
