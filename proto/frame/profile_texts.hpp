// The texts of config/skeletons/*.toml and config/hands/*.toml, which CMake writes into the binary
// (proto/CMakeLists.txt).
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

}  // namespace posed
