// The one way to read a whole file: regular files only, up to a size limit. A folder, a pipe
// without a writer and /dev/zero are an error at once. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed {

// The kind of file and its maximum size.
struct FileRule {
  std::string_view what = "file";  // the kind in error messages, for example "calibration"
  std::uintmax_t max_bytes = 0;
};

// Returns all bytes of the file. An Error names the path and the reason.
[[nodiscard]] Result<std::string> load_file(const std::filesystem::path& path,
                                            const FileRule& rule);

}  // namespace posed
