// The folder for the demo's clips and models, and the check whether they are what this program
// would make again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::tools {

// The demo's config in its folder: config/demo.toml, which is part of the binary, with the paths of
// that folder.
inline constexpr const char* kDemoConfig = "demo.toml";

// $XDG_CACHE_HOME/posed/demo, or ~/.cache/posed/demo.
[[nodiscard]] Result<std::filesystem::path> demo_cache_folder();

class DemoFolder {
 public:
  explicit DemoFolder(std::filesystem::path path) : path_(std::move(path)) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  // Whether every file is there as this program wrote it; false after another build of posed wrote
  // them, or after a file was changed.
  [[nodiscard]] bool is_up_to_date() const;

  // Refuses a folder with files of these names that no demo wrote; `overwrite` allows it.
  [[nodiscard]] Result<> check_is_own(const std::vector<std::string>& names, bool overwrite) const;

  // Marks the folder as the demo's before its files come: one that was interrupted is made anew.
  [[nodiscard]] Result<> begin() const;

  // Writes the config, and the stamp that is_up_to_date() reads, with a hash of every file in the
  // folder.
  [[nodiscard]] Result<> finish() const;

 private:
  std::filesystem::path path_;
};

}  // namespace posed::tools
