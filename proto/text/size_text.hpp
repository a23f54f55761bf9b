// A size in bytes as text for a sentence: "64 KB", "1 MB", "2 GB".
#pragma once

#include <cstdint>
#include <string>

namespace posed {

[[nodiscard]] inline std::string size_text(std::uintmax_t bytes) {
  constexpr std::uintmax_t kKilo = 1024;
  if (bytes >= kKilo * kKilo * kKilo)
    return std::to_string(bytes / (kKilo * kKilo * kKilo)) + " GB";
  if (bytes >= kKilo * kKilo) return std::to_string(bytes / (kKilo * kKilo)) + " MB";
  if (bytes >= kKilo) return std::to_string(bytes / kKilo) + " KB";
  return std::to_string(bytes) + " bytes";
}

}  // namespace posed
