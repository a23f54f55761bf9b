// Converts the pipeline's decisions to rows of a device log and back. No other code does. Cold.
#pragma once

#include <string>

#include "daemon/pipeline/messages.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

[[nodiscard]] log::DecisionRow row_of(const pipeline::Decision& decision);

// The decision in a row. Rows of format 3 store `sequence` only for kShed and kShedSamples; those
// of older formats store it for every decision. A row that no pipeline can have written is damage:
// the error names `file` and the row.
Result<pipeline::Decision> decision_of(const log::DecisionRow& row, const std::string& file);

}  // namespace posed::record
