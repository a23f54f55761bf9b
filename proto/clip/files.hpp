// Loads the files that make up one clip as text; private to proto/clip.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "proto/clip/reader.hpp"

namespace posed::clip {

enum class ClipKind : std::uint8_t { kBvh, kAmc, kHandCsv };

struct ClipFiles {
  std::string name;  // name of the clip, for error messages
  std::string text;  // content of the .bvh, .amc or .csv
  ClipKind kind = ClipKind::kBvh;
  std::string asf_name;  // AMC only
  std::string asf;
};

// Loads a .bvh, a .csv, or an .amc with its skeleton, chosen by extension.
[[nodiscard]] Result<ClipFiles> load_files(const std::filesystem::path& path,
                                           const ReadOptions& options);

// Views in the result point into `files`.
[[nodiscard]] Result<Draft> draft_of(const ClipFiles& files, const ReadOptions& options);

}  // namespace posed::clip
