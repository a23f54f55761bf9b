// The bytes of model files, each read once: the bodies of a source share them, and a file that
// changes while the daemon runs changes no stream. Cold.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "proto/frame/result.hpp"
#include "proto/model/model_file.hpp"

namespace posed::devices {

using ModelBytes = std::shared_ptr<const std::string>;

class ModelFiles {
 public:
  Result<ModelBytes> load(const std::filesystem::path& path) {
    ModelBytes& bytes = bytes_[path];
    if (bytes) return bytes;
    auto read = TRY(model_file::load(path));
    bytes = std::make_shared<const std::string>(std::move(read));
    return bytes;
  }

 private:
  std::map<std::filesystem::path, ModelBytes> bytes_;
};

}  // namespace posed::devices
