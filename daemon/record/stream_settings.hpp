// A stream's settings as the device log keeps them (stream.stages_json): JSON with every default
// filled in, so that a log means the same when defaults change. Numbers come back to the bit.
#pragma once

#include <string>

#include "daemon/pipeline/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::record {

using pipeline::StageModel;
using pipeline::StreamSettings;

[[nodiscard]] std::string to_json(const StreamSettings& settings);
// `file` is the log's name, for the error. Stages that this posed does not have are refused.
[[nodiscard]] Result<StreamSettings> settings_from_json(const std::string& json,
                                                        const std::string& file);

// source.config: a driver's options, as it was opened with them.
[[nodiscard]] std::string to_json(const drivers::Options& options);

}  // namespace posed::record
