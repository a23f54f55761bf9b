// The takes of a finished log as files.
#pragma once

#include <filesystem>

#include "proto/frame/result.hpp"

namespace posed::tools {

// Writes each take of each stream with a pose as <log without .plog>-<take>-<stream>.bvh. A clip
// that cannot be written is a warning; the log is not changed. An end signal that comes meanwhile
// ends the work with an error: block end_signals() before.
[[nodiscard]] Result<> write_take_clips(const std::filesystem::path& log);

}  // namespace posed::tools
