// What the names of clip files tell. Cold.
#pragma once

#include <filesystem>
#include <string>

#include "proto/clip/text.hpp"

namespace posed::clip {

// In small letters, with its dot: ".bvh". Empty where there is none.
[[nodiscard]] inline std::string extension_of(const std::filesystem::path& path) {
  return lower(path.extension().string());
}

// Where the skeleton of an AMC clip is, unless the user names it: NN.asf beside NN_MM.amc.
[[nodiscard]] inline std::filesystem::path skeleton_beside(const std::filesystem::path& amc) {
  const std::string stem = amc.stem().string();
  return amc.parent_path() / (stem.substr(0, stem.find('_')) + ".asf");
}

}  // namespace posed::clip
