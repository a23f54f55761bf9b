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

// A size in bytes as text for a sentence: "64 KB", "1 MB", "2 GB".
[[nodiscard]] inline std::string size_text(std::uintmax_t bytes) {
  constexpr std::uintmax_t kKilo = 1024;
  if (bytes >= kKilo * kKilo * kKilo)
    return std::to_string(bytes / (kKilo * kKilo * kKilo)) + " GB";
  if (bytes >= kKilo * kKilo) return std::to_string(bytes / (kKilo * kKilo)) + " MB";
  if (bytes >= kKilo) return std::to_string(bytes / kKilo) + " KB";
  return std::to_string(bytes) + " bytes";
}

// An Error if nothing of that name is there, or if it cannot be reached, which says why.
Result<> expect_there(const std::filesystem::path& path);

// Whether this process has the file open to read and write, as SQLite has a log. If it were opened
// once more, under whatever name, to close it again would end SQLite's locks on it.
[[nodiscard]] bool is_written_here(const std::filesystem::path& path);

// Returns all bytes of the file. An Error names the path and the reason.
Result<std::string> load_file(const std::filesystem::path& path, const FileRule& rule);

}  // namespace posed
