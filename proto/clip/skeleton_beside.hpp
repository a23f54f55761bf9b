// Where the skeleton of an AMC clip is, unless the user names it.
#pragma once

#include <filesystem>
#include <string>

namespace posed::clip {

// The path of NN.asf beside NN_MM.amc.
[[nodiscard]] inline std::filesystem::path skeleton_beside(const std::filesystem::path& amc) {
  const std::string stem = amc.stem().string();
  return amc.parent_path() / (stem.substr(0, stem.find('_')) + ".asf");
}

}  // namespace posed::clip
