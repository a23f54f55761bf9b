// A stream's settings as the device log stores them (stream.stages_json): JSON that includes every
// default, so that a log keeps its meaning when defaults change. Numbers are restored exactly.
#pragma once

#include <string>

#include "daemon/pipeline/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::record {

using pipeline::StreamSettings;

[[nodiscard]] std::string to_json(const StreamSettings& settings);
// `file` is the log's name, for the error. The partners of stages are the ids of streams, where the
// log names them. Refuses stages that this version of posed does not have.
Result<StreamSettings> settings_from_json(const std::string& json, const std::string& file);

// source.config: the options with which a driver was opened, and the text of the user's mapping of
// its bodies' joints, empty for none.
[[nodiscard]] std::string to_json(const drivers::Options& options, const std::string& mapping);
Result<std::string> mapping_from_json(const std::string& json, const std::string& file);

}  // namespace posed::record
