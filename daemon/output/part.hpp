// The parts of an avatar that have streams of their own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace posed::output {

enum class Part : std::uint8_t { kBody, kLeftHand, kRightHand };
inline constexpr std::size_t kParts = 3;
inline constexpr std::array<Part, kParts> kAllParts{Part::kBody, Part::kLeftHand, Part::kRightHand};

[[nodiscard]] constexpr std::size_t index_of(Part part) noexcept {
  return static_cast<std::size_t>(part);
}

// The name of the part in the config.
[[nodiscard]] constexpr std::string_view words_for(Part part) noexcept {
  constexpr std::array<std::string_view, kParts> kWords{"body", "left hand", "right hand"};
  return kWords[index_of(part)];
}

}  // namespace posed::output
