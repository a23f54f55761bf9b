// Opens the file of a log to read it: checks that it is a log, of a format that is known, and not
// damaged, and merges what a crash has left beside it. Cold.
#pragma once

#include <filesystem>

#include "proto/frame/result.hpp"
#include "proto/log/database.hpp"

namespace posed::log {

struct OpenedLog {
  Database database;
  int format;  // kFormatVersion or an older one
};
[[nodiscard]] Result<OpenedLog> open_whole(const std::filesystem::path& path);

}  // namespace posed::log
