// The texts of files of config/skeletons, config/hands, config/devices and config/camera, which
// CMake writes into the binary (proto/CMakeLists.txt), by name.
#pragma once

#include <span>
#include <string_view>

namespace posed {

struct ConfigText {
  std::string_view file;  // "cmu-bvh.toml"
  std::string_view content;
};

[[nodiscard]] std::span<const ConfigText> profile_texts();
[[nodiscard]] std::span<const ConfigText> hand_texts();
[[nodiscard]] std::span<const ConfigText> device_texts();
[[nodiscard]] std::span<const ConfigText> camera_texts();

}  // namespace posed
