// FRAMES.bin: repeated {u32 little-endian length, posed.v1.Frame}, in pipeline order, stage stamps
// unset.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {

class FrameFile {
 public:
  static Result<FrameFile> create(const std::filesystem::path& path);

  void add(const v1::Frame& frame);
  // Gives the file its name, if everything was written. Without it there is no file, or the old
  // one.
  Result<> close() { return file_.keep(); }

 private:
  explicit FrameFile(WholeFile file) : file_(std::move(file)) {}

  WholeFile file_;
  std::string bytes_;
};

}  // namespace posed::tools
