// FRAMES.bin: repeated {u32 little-endian length, posed.v1.Frame}, in pipeline order, stage stamps
// unset.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::tools {

class FrameFile {
 public:
  static Result<FrameFile> create(const std::filesystem::path& path);

  void add(const v1::Frame& frame);
  // Returns whether everything was written.
  Result<> close();

 private:
  FrameFile(std::ofstream file, std::filesystem::path path)
      : file_(std::move(file)), path_(std::move(path)) {}

  std::ofstream file_;
  std::filesystem::path path_;
  std::string bytes_;
};

}  // namespace posed::tools
