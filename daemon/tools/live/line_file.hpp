// LineFile: a text file that grows by whole lines, whenever its writer ends. It has one writer.
// Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <utility>

#include "proto/frame/result.hpp"

namespace posed::tools {

class LineFile {
 public:
  // The file is made by the first line; `overwrite`: an old one is emptied by it, which otherwise
  // is an error.
  LineFile(std::filesystem::path path, bool overwrite)
      : path_(std::move(path)), overwrite_(overwrite) {}
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  // Writes the line and its end in one piece. After an error (a full disk) the lines before it stay
  // and nothing of this one.
  Result<> add(std::string_view line);

 private:
  Result<> open();

  std::filesystem::path path_;
  bool overwrite_ = false;
  int fd_ = -1;
  std::uint64_t size_ = 0;  // bytes of whole lines
};

}  // namespace posed::tools
