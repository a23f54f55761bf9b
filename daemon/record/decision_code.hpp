// The one place where the pipeline's decisions become rows of a device log, and rows decisions.
// Cold.
#pragma once

#include <string>

#include "daemon/pipeline/messages.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

[[nodiscard]] log::DecisionRow row_of(const pipeline::Decision& decision);

// What the pipeline decided. Of `sequence`, rows of format 3 keep only what kShed and kShedSamples
// say; those of the older formats say it of every decision. A row that no pipeline could have
// written is damage: the error names `file` and the row.
[[nodiscard]] Result<pipeline::Decision> decision_of(const log::DecisionRow& row,
                                                     const std::string& file);

}  // namespace posed::record
