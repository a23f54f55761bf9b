// What a replay cannot repeat, because the log does not hold it. Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/replay/replay.hpp"
#include "proto/log/reader.hpp"

namespace posed::tools {

// One sentence for each gap, for each body without a description and for each source without a
// stream.
[[nodiscard]] std::vector<std::string> missing_from(const log::Reader& reader,
                                                    const replay::Replay& replay);

}  // namespace posed::tools
