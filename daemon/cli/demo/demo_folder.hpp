// Where the demo keeps what it has made and learnt, and whether that is what this very program
// would make again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::cli {

// The demo's config inside its folder: config/demo.toml, which travels inside the binary, with the
// paths of that folder.
inline constexpr const char* kDemoConfig = "demo.toml";

// $XDG_CACHE_HOME/posed/demo, or ~/.cache/posed/demo.
[[nodiscard]] Result<std::filesystem::path> demo_cache_folder();

class DemoFolder {
 public:
  explicit DemoFolder(std::filesystem::path path) : path_(std::move(path)) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  // Whether every file is there as this program wrote it. Another build of posed, or a file that
  // was changed, makes it false.
  [[nodiscard]] bool is_up_to_date() const;

  // Refuses a folder that holds files of these names which no demo wrote; `overwrite` allows them.
  [[nodiscard]] Result<> check_is_own(const std::vector<std::string>& names, bool overwrite) const;

  // Writes the config, and then what is_up_to_date() reads about all files of the folder.
  [[nodiscard]] Result<> finish() const;

 private:
  std::filesystem::path path_;
};

}  // namespace posed::cli
