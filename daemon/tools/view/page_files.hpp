// PageFiles: the files of the page, read into memory at the start. What the network names is only
// looked up in this list and never becomes a path. Does not change afterwards. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::view {

inline constexpr std::size_t kMaxPageFiles = 256;
inline constexpr std::size_t kMaxPageBytes = 64 * 1024 * 1024;  // of all files together

struct PageFile {
  std::string bytes;
  std::string_view type;  // MIME type, by the extension
  std::string etag;       // with its quotes; changes when the bytes do
};

class PageFiles {
 public:
  // Reads all regular files below `folder` whose names do not begin with a dot; links are not
  // followed. An Error tells a folder without index.html from one with too much in it.
  [[nodiscard]] static Result<PageFiles> load(const std::filesystem::path& folder);

  // The file of a target without its query, such as "/page.js"; "/" is index.html. Null: there is
  // none. Valid as long as this object.
  [[nodiscard]] const PageFile* find(std::string_view path) const;

 private:
  std::map<std::string, PageFile, std::less<>> files_;  // by "/name"
};

// The MIME type that browsers expect of a file of this name.
[[nodiscard]] std::string_view type_of_name(std::string_view name);

}  // namespace posed::view
