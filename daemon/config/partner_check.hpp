// Whether the streams that stages name as partners (StageType::partners) can be that.
#pragma once

#include "daemon/config/daemon_config.hpp"
#include "proto/text/findings.hpp"

namespace posed::config {

// Adds an error for each partner that does not exist, is the stream itself or the body of a source,
// or has partners itself. Call when all streams and sources are read.
void check_partners(const DaemonConfig& config, Findings& findings);

}  // namespace posed::config
