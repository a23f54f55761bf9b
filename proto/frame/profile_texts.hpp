// The texts of config/skeletons/*.toml, config/hands/*.toml and config/devices/*.toml, which CMake
// writes into the binary (proto/CMakeLists.txt).
#pragma once

#include <span>
#include <string_view>

namespace posed {

struct ProfileText {
  std::string_view file;  // "cmu-bvh.toml"
  std::string_view toml;
};

[[nodiscard]] std::span<const ProfileText> profile_texts();
[[nodiscard]] std::span<const ProfileText> hand_texts();
[[nodiscard]] std::span<const ProfileText> device_texts();

}  // namespace posed
