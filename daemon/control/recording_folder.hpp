// RecordingFolder: the logs and clips that a client may list and fetch by name. Nothing from the
// network names a path: a name counts only if it is that of a recording in this folder. list()
// reads the folder each time, piece() that file alone. Any thread; cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::control {

inline constexpr std::size_t kMaxRecordingPiece = 32 * 1024;  // bytes

struct FolderRecording {
  std::string name;  // of the file
  std::uint64_t bytes = 0;
  std::int64_t changed_unix_s = 0;
  bool in_use = false;  // a -wal file lies beside it: it is written, or its writer was killed
};

class RecordingFolder {
 public:
  RecordingFolder() = default;  // no folder: each call fails and says how to name one
  // The folder need not be there yet.
  explicit RecordingFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Regular files that end in .plog or .bvh, the newest first; at most 256.
  Result<std::vector<FolderRecording>> list() const;
  // At most kMaxRecordingPiece bytes of a recording in the folder from `offset` on; empty at its
  // end. A log that is in use is refused.
  Result<std::string> piece(std::string_view name, std::uint64_t offset) const;

  // A part of a clip that ends in .bvh as another kind of file.
  struct Part {
    std::string name{};
    std::string as{};                 // "glb" or "vrma"
    double from_s = 0.0, to_s = 0.0;  // to_s 0: to the clip's end
    bool operator==(const Part&) const = default;
  };
  // Returns the bytes of the new file, which is in a hidden folder in this one while it is made. A
  // whole clip of more than 12 MiB or 1.5 million values is refused, however short the part, and a
  // new file of more than 12 MiB, too. Takes up to a second and 64 MB: callers take turns.
  Result<std::string> converted(const Part& part) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace posed::control
