// The one way to read a whole file: regular files only, and never more of one than it may hold. A
// folder, a pipe that nobody fills and /dev/zero are refused with a sentence, at once. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed {

// What is read, and how large it may be at most.
struct FileRule {
  std::string_view what = "file";  // names the kind in sentences: "calibration"
  std::uintmax_t max_bytes = 0;
};

// All bytes of the file. An Error names the path and says why it cannot be read.
[[nodiscard]] Result<std::string> load_file(const std::filesystem::path& path,
                                            const FileRule& rule);

}  // namespace posed
