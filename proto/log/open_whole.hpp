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

// The format of a log, without reading the rest of it or changing anything. An error for what
// open_whole() refuses by its first bytes.
[[nodiscard]] Result<int> format_of(const std::filesystem::path& path);

}  // namespace posed::log
